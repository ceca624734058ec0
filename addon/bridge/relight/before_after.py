"""Before and after: one view under the captured and under the current light, side by side.

In background mode the pictures are rendered here. Beside a window the command line renders a saved copy of the scene
(`save_copy`), so that the window never freezes, the open scene does not change, and stopping ends a process.
"""

import os
import tempfile
from pathlib import Path

import bpy

from ...core.atomic import TEMPORARY
from ...core.errors import BadInputError
from ...core.io.folder import MATERIALS, SCENE
from ...core.progress import Progress
from ..custom_properties import RESULT
from ..refused import refused
from .pictures import check_format, render_stage, save_side_by_side
from .setup import captured_light

NAME = "Before and After"
"""Name of the image in Blender."""


def render_pair(scene: bpy.types.Scene, target: Path, progress: Progress | None = None) -> None:
    """Render both pictures, one after the other, and save them side by side; within `pictures.settings_kept`."""
    ending = check_format(target)
    if scene.camera is None:
        raise BadInputError("The scene has no camera to render through; choose a frame of the capture first.")
    progress = progress or Progress()
    with refused(f"'{target}' can't be written", "choose another folder"):
        target.parent.mkdir(parents=True, exist_ok=True)
        name = f"{TEMPORARY}{os.getpid()}-"
        temporary_folder = tempfile.TemporaryDirectory(prefix=name, dir=target.parent, ignore_cleanup_errors=True)
    with temporary_folder as folder:
        before, after = Path(folder, f"before{ending}"), Path(folder, f"after{ending}")
        with captured_light(scene):
            seconds = render_stage(scene, before, progress, "before")
        render_stage(scene, after, progress, "after", seconds)
        save_side_by_side(before, after, target)


def picture_folder(scene: bpy.types.Scene, chosen: str = "") -> tuple[Path, bool]:
    """Default folder of a picture of a scene, and whether it persists when Blender quits.

    The result folder that the open file lies in, else the one that the room came from, else the `chosen` one, else
    beside the file; a folder that is missing or can't be written to is skipped. Where none is left it is Blender's
    temporary folder.
    """
    beside_file = bpy.path.abspath("//") if bpy.data.filepath else ""
    candidates = [item[RESULT] for item in (*scene.collection.children_recursive, *scene.objects) if RESULT in item]
    candidates += [bpy.path.abspath(chosen), beside_file]
    if beside_file and (Path(beside_file) / MATERIALS).is_file():
        candidates.insert(0, beside_file)
    for candidate in dict.fromkeys(candidates):
        if candidate and Path(candidate).is_absolute() and Path(candidate).is_dir() and os.access(candidate, os.W_OK):
            return Path(candidate), True
    return Path(bpy.app.tempdir), False


def save_copy(folder: Path) -> None:
    """Save a copy of the open file for the command `relight`; the open file stays as it is."""
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
