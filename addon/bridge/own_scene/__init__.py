"""The artist's own scene as a capture, and the materials back onto its objects."""
