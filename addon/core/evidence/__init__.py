"""How sure the results are: standard errors per texel, intervals per object, and the page that shows them."""
