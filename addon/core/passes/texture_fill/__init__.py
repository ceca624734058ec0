"""Texture for what no frame saw, from the measured part of the same plane."""
