"""The artist's statements on objects, and the refit that follows."""
