"""Restores the detail that the lit diffuse texture lost by blur."""
