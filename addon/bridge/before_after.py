"""Before and after: one view under the captured and under the present light, side by side.

In background mode the pictures are rendered here. In a window another Blender renders saved copies of the scene, so
that the window never freezes, nothing of the open scene changes, and a stop is a matter of ending that process.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import bpy

from ..core.errors import BadInputError
from .pictures import beside, check_format, shoot
from .relight_state import captured_light

NAME = "Before / After"
"""Name of the image in Blender."""


def render_pair(scene: bpy.types.Scene, out: Path) -> None:
    """Render both pictures, one after the other, and save them side by side; within `pictures.settings_kept`."""
    ending = check_format(out)
    if scene.camera is None:
        raise BadInputError("The scene has no camera to render through; choose a frame of the capture first.")
    folder = Path(tempfile.mkdtemp(prefix="scan_relight_"))
    try:
        before, after = folder / f"before{ending}", folder / f"after{ending}"
        with captured_light(scene):
            shoot(scene, before)
        shoot(scene, after)
        beside(before, after, out)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def show(path: Path) -> bpy.types.Image:
    """The finished picture as an image in Blender; an earlier one is replaced."""
    image = bpy.data.images.get(NAME)
    if image is None:
        image = bpy.data.images.load(str(path))
        image.name = NAME
    else:
        image.filepath = str(path)
        image.reload()
    return image
