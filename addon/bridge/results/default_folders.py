"""Where results go: beside the .blend or among the artist's documents, never into the extension's own folders."""

import os
import tempfile
from pathlib import Path

import bpy

from ...core.errors import BadInputError
from ...core.io.folder import SCENE
from ...core.results.result_folders import DOCUMENTS_FOLDER, FOLDER_BESIDE, captures, documents, free_folder, own_folder
from ..custom_properties import CAPTURE, RESULT

PACKAGE = __package__.rsplit(".", 3)[0]
"""The root package, under whatever name Blender installed it."""
CAPTURES, UNSAVED = "captures", "unsaved scene"
"""Folder of captures of scenes among the results; the name of a capture whose .blend was never saved."""


def results_folder(preferred: str = "") -> Path:
    """The folder of results that are beside no .blend: the preference's, or one among the user's documents."""
    if preferred:
        folder = Path(bpy.path.abspath(preferred)).absolute()
        if not is_in_extension(folder):
            return folder
    return documents() / DOCUMENTS_FOLDER


def result_folder(capture: Path, results_root: Path, scene: bpy.types.Scene | None = None) -> Path:
    """The default result folder of a capture, an absolute path; it is not created here.

    That of the room of this capture which `scene` has; else a new one, beside the .blend or in `results_root`, which
    is what `results_folder` gave.
    """
    existing = _result_of_room(scene, capture) if scene is not None else None
    return existing or own_folder(folder_beside_file() or results_root, capture)


def capture_folder(results_root: Path, chosen: str) -> Path:
    """The folder that a capture of the open scene goes to; the previous one is `chosen` in the panel."""
    if bpy.data.filepath:
        return (folder_beside_file() or results_root) / CAPTURES / Path(bpy.data.filepath).stem
    previous = Path(bpy.path.abspath(chosen)) if chosen else None
    if previous is not None and previous.parent == results_root / CAPTURES and previous.name.startswith(UNSAVED):
        return previous
    return free_folder(results_root / CAPTURES, UNSAVED)


def folder_beside_file() -> Path | None:
    """The folder of results beside the saved .blend; None where that is no permanent folder."""
    if not bpy.data.filepath:
        return None
    folder = Path(bpy.data.filepath).parent
    # Recovered sessions lie there.
    temporary = {Path(path).resolve() for path in (tempfile.gettempdir(), bpy.app.tempdir) if path}
    if folder.resolve() in temporary or is_in_extension(folder) or not os.access(folder, os.W_OK):
        return None
    return folder / FOLDER_BESIDE


def display_path(folder: Path) -> str:
    """A folder's path for display: relative to the .blend's folder, or to the home folder."""
    for root, prefix in ((Path(bpy.data.filepath).parent if bpy.data.filepath else None, "//"), (Path.home(), "~/")):
        if root is not None and folder.is_relative_to(root):
            return prefix + folder.relative_to(root).as_posix()
    return str(folder)


def is_in_extension(folder: Path) -> bool:
    """Whether removing or updating the extension could delete a folder."""
    extensions = bpy.utils.user_resource("EXTENSIONS")  # includes the folder that Blender has for each extension
    roots = [Path(__file__).parents[3], *([Path(extensions)] if extensions else ())]
    return any(folder.resolve().is_relative_to(root.resolve()) for root in roots)


def check(folder: str) -> None:
    """Raise `BadInputError` where a chosen result folder is inside the extension."""
    if is_in_extension(Path(folder)):
        raise BadInputError(
            f"Result folder '{folder}' belongs to the extension, and removing that would delete the "
            "result; choose another."
        )


def _result_of_room(scene: bpy.types.Scene, capture: Path) -> Path | None:
    """The result that a scene's room of a capture came from, if a run can continue there."""
    for collection in scene.collection.children_recursive:
        folder_name = collection.get(RESULT)
        if not folder_name or collection.get(CAPTURE) != str(capture):
            continue
        folder = Path(folder_name)
        is_open = Path(bpy.data.filepath) == folder / SCENE
        if capture in captures(folder) and not is_in_extension(folder) and not is_open:
            return folder
    return None
