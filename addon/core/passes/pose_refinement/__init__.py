"""Corrects the poses of frames that are misaligned with the texture of all of them."""
