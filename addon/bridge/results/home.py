"""Where results go: beside the .blend or among the artist's documents, never where removing the extension clears."""

import os
import tempfile
from pathlib import Path

import bpy

from ...core.errors import BadInputError
from ...core.io.folder import SCENE
from ...core.results.place import BESIDE, HOME, captures, documents, free_folder, own_folder
from ..marks import CAPTURE, RESULT

PACKAGE = __package__.rsplit(".", 3)[0]
"""The root package, under whatever name Blender installed it."""
CAPTURES, UNSAVED = "captures", "unsaved scene"
"""Folder among the results that captures of scenes go to; the name of one whose .blend was never saved."""


def results_folder(preferred: str = "") -> Path:
    """The folder of results that lie beside no .blend: the preference's, or one among the user's documents."""
    if preferred:
        folder = Path(bpy.path.abspath(preferred)).absolute()
        if not is_ours(folder):
            return folder
    return documents() / HOME


def result_folder(capture: Path, home: Path, scene: bpy.types.Scene | None = None) -> Path:
    """The result folder of a capture that none was chosen for; it is not made here.

    Parameters
    ----------
    capture : Path
        Absolute.
    home : Path
        What `results_folder` gave.
    scene : bpy.types.Scene, optional
        Where a room of this capture is in it, its result goes on where it lies.
    """
    found = _of_room(scene, capture) if scene is not None else None
    return found or own_folder(beside() or home, capture)


def capture_folder(home: Path, chosen: str) -> Path:
    """The folder that a capture of the open scene goes to; the one that it went to before is `chosen` in the panel."""
    if bpy.data.filepath:
        return (beside() or home) / CAPTURES / Path(bpy.data.filepath).stem
    before = Path(bpy.path.abspath(chosen)) if chosen else None
    if before is not None and before.parent == home / CAPTURES and before.name.startswith(UNSAVED):
        return before
    return free_folder(home / CAPTURES, UNSAVED)


def beside() -> Path | None:
    """The folder of results beside the saved .blend; None where that is nowhere to keep anything."""
    if not bpy.data.filepath:
        return None
    folder = Path(bpy.data.filepath).parent
    passing = {Path(one).resolve() for one in (tempfile.gettempdir(), bpy.app.tempdir) if one}  # recovered sessions
    if folder.resolve() in passing or is_ours(folder) or not os.access(folder, os.W_OK):
        return None
    return folder / BESIDE


def shown(folder: Path) -> str:
    """A folder as the artist knows it: from the .blend's folder on, or from the home folder on."""
    for start, sign in ((Path(bpy.data.filepath).parent if bpy.data.filepath else None, "//"), (Path.home(), "~/")):
        if start is not None and folder.is_relative_to(start):
            return sign + folder.relative_to(start).as_posix()
    return str(folder)


def is_ours(folder: Path) -> bool:
    """Whether removing or updating the extension could delete what lies in a folder."""
    own = [Path(__file__).parents[3]]
    extensions = bpy.utils.user_resource("EXTENSIONS")
    if extensions:
        own.append(Path(extensions))  # with it the folder that Blender keeps for each extension
    folder = folder.resolve()
    return any(folder.is_relative_to(one.resolve()) for one in own)


def check(folder: str) -> None:
    """Raise `BadInputError` where a chosen result folder is one that results are lost in."""
    if is_ours(Path(folder)):
        raise BadInputError(
            f"Result folder '{folder}' belongs to the extension, and removing that would delete the "
            "result; choose another."
        )


def _of_room(scene: bpy.types.Scene, capture: Path) -> Path | None:
    """The result that a scene's room of a capture came from, if a run can go on there."""
    for collection in scene.collection.children_recursive:
        told = collection.get(RESULT)
        if not told or collection.get(CAPTURE) != str(capture):
            continue
        folder = Path(told)
        open_file = Path(bpy.data.filepath) if bpy.data.filepath else None
        if capture in captures(folder) and not is_ours(folder) and open_file != folder / SCENE:
            return folder
    return None
