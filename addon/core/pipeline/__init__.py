"""The stages in their order, and what is run again of them."""
