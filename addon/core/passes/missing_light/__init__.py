"""Solves for clipped patches and for what comes in by the holes of a mesh without objects."""
