"""Lit diffuse texture L_d: every frame is projected onto the surface elements it sees; a median drops highlights."""
