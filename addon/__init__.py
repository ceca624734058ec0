"""Scan Relight's code: ``core`` knows no Blender, ``bridge`` is all that touches Blender's data."""
