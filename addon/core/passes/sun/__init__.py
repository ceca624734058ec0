"""Finds the sun from the light that it throws through the openings, clipped or not."""
