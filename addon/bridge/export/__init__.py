"""The room for other programs, and its materials as assets."""
