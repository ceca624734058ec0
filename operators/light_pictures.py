"""The kinds of new light, each with a small picture of what it does to a room."""

from __future__ import annotations

import atexit
from pathlib import Path

import bpy

PRESETS = (("WINDOW", "Window", "A window's soft, cool light from the side"),
           ("SOFTBOX", "Softbox", "A studio light beside the camera"),
           ("SPOT", "Spot", "A spot from above, a little on the camera's side"),
           ("SUN", "Evening Sun", "A low, warm sun: through an opening of the scan, else as a window would let it in"))
FOLDER = Path(__file__).with_name("thumbnails")
_pictures = None
_items: list[tuple] = []  # Blender keeps no reference to what a callback returns


def light_items(studio, context) -> list[tuple]:
    """Items of an enumeration of `PRESETS`, with their pictures where Blender has a window to show them in."""
    if not _items:
        _items[:] = [(name, text, told, 0 if bpy.app.background else _picture(name), number)
                     for number, (name, text, told) in enumerate(PRESETS)]
    return _items


def _picture(name: str) -> int:
    """Blender's number of a preset's picture."""
    global _pictures
    if _pictures is None:
        import bpy.utils.previews

        _pictures = bpy.utils.previews.new()
        atexit.register(forget)
    path = FOLDER / f"{name.lower()}.png"
    if name not in _pictures:
        _pictures.load(name, str(path), "IMAGE")
    return _pictures[name].icon_id


def forget() -> None:
    """Let go of the pictures."""
    global _pictures
    _items.clear()
    if _pictures is not None:
        bpy.utils.previews.remove(_pictures)
        _pictures = None
        atexit.unregister(forget)
