"""Readers of captures, meshes and pictures: each format is one file, and knows nothing of the method."""
