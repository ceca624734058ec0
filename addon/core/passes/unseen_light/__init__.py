"""Solves for lamps and sky that no frame saw, from the light that they throw."""
