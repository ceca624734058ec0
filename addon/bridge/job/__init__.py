"""A run, a refit, and the process of its own that they go on in."""
