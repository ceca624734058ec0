"""The published method, plain: Haefner et al., 3DV 2021."""
