"""Before and after: one view under the captured and under the present light, side by side.

In background mode the pictures are rendered here. Beside a window the command line renders a saved copy of the scene
(`save_copy`), so that the window never freezes, nothing of the open scene changes, and a stop ends a process.
"""

import os
import tempfile
import time
from pathlib import Path

import bpy

from ...core.atomic import TEMPORARY
from ...core.errors import BadInputError
from ...core.io.folder import MATERIALS, SCENE
from ...core.progress import Progress
from ..marks import RESULT
from ..refused import refused
from .pictures import beside, check_format, seconds_expected, shoot, ticking
from .setup import captured_light

NAME = "Before and After"
"""Name of the image in Blender."""


def render_pair(scene: bpy.types.Scene, out: Path, progress: Progress | None = None) -> None:
    """Render both pictures, one after the other, and save them side by side; within `pictures.settings_kept`."""
    ending = check_format(out)
    if scene.camera is None:
        raise BadInputError("The scene has no camera to render through; choose a frame of the capture first.")
    progress = progress or Progress()
    with refused(f"'{out}' can't be written", "choose another folder"):
        out.parent.mkdir(parents=True, exist_ok=True)
        scratch = tempfile.TemporaryDirectory(
            prefix=f"{TEMPORARY}{os.getpid()}-", dir=out.parent, ignore_cleanup_errors=True
        )
    with scratch as folder:
        before, after = Path(folder, f"before{ending}"), Path(folder, f"after{ending}")
        progress.stage("before")
        with captured_light(scene):
            expected = seconds_expected(scene)
            began = time.monotonic()
            with ticking(progress, expected):
                shoot(scene, before)
            taken = time.monotonic() - began
        progress.done()
        progress.stage("after")
        with ticking(progress, taken):
            shoot(scene, after)
        progress.done()
        beside(before, after, out)


def picture_folder(scene: bpy.types.Scene, chosen: str = "") -> tuple[Path, bool]:
    """Where a picture of a scene goes unless told.

    The result folder that the open file lies in, else the one that the room came from, else the `chosen` one, else
    beside the file; a folder that is gone or can't be written to is passed over. Where none is left it is Blender's own
    for things of passing use.

    Returns
    -------
    (Path, bool)
        The folder; whether it stays when Blender ends.
    """
    beside_file = bpy.path.abspath("//") if bpy.data.filepath else ""
    places = [thing[RESULT] for thing in (*scene.collection.children_recursive, *scene.objects) if RESULT in thing]
    places += [bpy.path.abspath(chosen), beside_file]
    if beside_file and (Path(beside_file) / MATERIALS).is_file():
        places.insert(0, beside_file)
    for place in dict.fromkeys(places):
        if place and Path(place).is_absolute() and Path(place).is_dir() and os.access(place, os.W_OK):
            return Path(place), True
    return Path(bpy.app.tempdir), False


def save_copy(folder: Path) -> None:
    """Save what is open as a copy that the command `relight` can open; what is open stays as it is."""
    with refused(f"A copy of the scene can't be saved to '{folder}'", "free some space"):
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / SCENE), copy=True, compress=False, relative_remap=True)


def show(path: Path) -> bpy.types.Image:
    """The finished picture as an image in Blender; an earlier one is replaced."""
    image = bpy.data.images.get(NAME)
    if image is None:
        image = bpy.data.images.load(str(path), check_existing=False)
        image.name = NAME
    else:
        image.filepath = str(path)
        image.reload()
    return image


def show_in_window(image: bpy.types.Image) -> None:
    """Show an image in an image editor; where none is open, in a window of its own."""
    manager = bpy.context.window_manager
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = image
                return
    known = {window.as_pointer() for window in manager.windows}
    with bpy.context.temp_override(window=manager.windows[0]):
        bpy.ops.wm.window_new()
    for window in manager.windows:
        if window.as_pointer() not in known:
            area = window.screen.areas[0]
            area.type = "IMAGE_EDITOR"
            area.spaces.active.image = image
