"""The fit of a lobe to what many frames show of an object: observations laid out, robust least squares."""
