"""Gives the lit diffuse texture the detail back that its blur took."""
