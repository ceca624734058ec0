"""The kinds of new light, each with a small picture of what it does to a room."""

from __future__ import annotations

import atexit
from pathlib import Path

import bpy

PRESETS = (
    ("WINDOW", "Window", "A window's soft, cool light from the side"),
    ("SOFTBOX", "Softbox", "A studio light beside the camera"),
    ("SPOT", "Spot", "A spot from above, a little on the camera's side"),
    ("SUN", "Evening Sun", "A low, warm sun: through an opening of the scan, else as a window would let it in"),
)
FOLDER = Path(__file__).resolve().parents[1] / "thumbnails"
_pictures = None


def picture(name: str) -> int:
    """Blender's number of a preset's picture; 0, for none, where it has no window to show one in."""
    global _pictures
    if bpy.app.background:
        return 0
    if _pictures is None:
        from bpy.utils import previews

        _pictures = previews.new()
        atexit.register(forget)
    path = FOLDER / f"{name.lower()}.png"
    if name not in _pictures:
        _pictures.load(name, str(path), "IMAGE")
    return _pictures[name].icon_id


def forget() -> None:
    """Let go of the pictures."""
    global _pictures
    if _pictures is not None:
        from bpy.utils import previews

        previews.remove(_pictures)
        _pictures = None
        atexit.unregister(forget)
