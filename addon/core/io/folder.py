"""What a folder or file that an artist has chosen is: a capture, a finished result, or the way to one of them."""

import os
from dataclasses import dataclass
from pathlib import Path

from ..kinds import Limit, Shown
from .files import json_if_sound

CAPTURE, RESULT, WAY, EMPTY, OTHER, ABSENT = "capture", "result", "way", "empty", "other", "absent"
MATERIALS, REPORT, SCENE = "materials.json", "report.json", "scene.blend"
VIDEOS = (".mp4", ".mov", ".m4v")
ABOVE: Limit[int] = 3
"""Levels above a chosen file on which its capture may begin: `sparse/0/cameras.bin`."""
LOOKED_AT: Limit[int] = 200
"""Sub-folders that are looked into: a folder of everything is nobody's capture."""
OFFERED: Shown[int] = 6
"""Sub-folders that are offered."""


@dataclass(frozen=True)
class Content:
    """What is in a folder.

    Attributes
    ----------
    kind : str
        `CAPTURE`; `RESULT`, a finished one; `WAY`, captures or results are right below or above; `EMPTY`; `OTHER`;
        `ABSENT`.
    sentence : str
        What is wrong with it as the folder of a capture, and what to do; '' for a capture.
    name : str
        Of the capture: the folder's, or the one that a result was made from.
    captures, results : tuple of Path
        What to take instead.
    """

    kind: str
    folder: Path
    sentence: str = ""
    name: str = ""
    captures: tuple[Path, ...] = ()
    results: tuple[Path, ...] = ()


def is_capture(folder: Path) -> bool:
    """Whether a folder has the files by which a known format begins; cheap, reads none of them."""
    from .readers import readers  # not earlier: interfaces know this module from their start, and readers take numpy

    return any(reader.find(folder) for reader in readers())


def is_result(folder: Path) -> bool:
    """Whether a folder holds what a run leaves at its end."""
    return (folder / MATERIALS).is_file() and (folder / SCENE).is_file()


def capture_name(result: Path) -> str:
    """Name of the capture that a result was made from; its folder's own where it does not tell."""
    for name in (MATERIALS, REPORT):
        capture = json_if_sound(result / name).get("capture")
        if isinstance(capture, str) and capture:
            return capture
    return result.name


def look_into(folder: Path | str) -> Content:
    """What `folder` is, one level deep; never raises for what is in it."""
    folder = Path(folder)
    name = folder.name or str(folder)
    if not folder.is_dir():
        what = "is a file, not a folder" if folder.exists() else "does not exist"
        return Content(ABSENT, folder, f"'{name}' {what}; choose the folder of a scan.", name)
    if is_capture(folder):
        return Content(CAPTURE, folder, name=name)
    if is_result(folder):
        capture = capture_name(folder)
        return Content(
            RESULT, folder, f"This is a finished result of '{capture}', not a scan.", capture, results=(folder,)
        )
    try:
        inside = sorted(os.scandir(folder), key=lambda entry: entry.name.lower())
    except OSError as error:
        return Content(
            OTHER, folder, f"Folder '{name}' can't be read ({error.strerror or error}); check its rights.", name
        )
    if not inside:
        return Content(EMPTY, folder, f"Folder '{name}' is empty; choose the folder of a scan.", name)
    below = [Path(entry.path) for entry in inside[:LOOKED_AT] if not entry.name.startswith(".") and entry.is_dir()]
    captures = [path for path in below if is_capture(path)]
    results = [path for path in below if is_result(path)]
    if captures or results:
        what = " and ".join(
            _count(paths, word) for paths, word in ((captures, "scan"), (results, "finished result")) if paths
        )
        return Content(
            WAY,
            folder,
            f"Folder '{name}' is no scan itself; {what} in it.",
            name,
            tuple(captures[:OFFERED]),
            tuple(results[:OFFERED]),
        )
    above = [path for path in list(folder.absolute().parents)[:ABOVE] if is_capture(path)]
    if above:
        return Content(WAY, folder, f"Folder '{name}' is a part of the scan '{above[-1].name}'.", name, (above[-1],))
    return Content(OTHER, folder, _other_sentence(name, [entry.name for entry in inside]), name)


def of_path(path: Path | str) -> Content:
    """What a chosen path means: a folder, or that which a file of a capture or of a result belongs to.

    A file that belongs to neither is `OTHER`, with a sentence.
    """
    path = Path(path)
    if path.is_dir() or not path.exists():
        return look_into(path)
    if path.name in (MATERIALS, SCENE, REPORT, "report.html") and is_result(path.parent):
        return look_into(path.parent)
    if path.suffix.lower() in (".json", ".ply", ".obj", ".glb", ".gltf", ".bin", ".txt", ".csv", *VIDEOS):
        begins = [folder for folder in (path.parent, *list(path.absolute().parents)[1:ABOVE]) if is_capture(folder)]
        if begins and not (path.suffix.lower() == ".json" and not _is_ours(path)):
            return look_into(begins[-1])
    return Content(
        OTHER,
        path,
        f"'{path.name}' is no part of a scan or of a result that is known here; take a scan's "
        f"'transforms.json' or a result's '{MATERIALS}'.",
        path.name,
    )


def _is_ours(path: Path) -> bool:
    """Whether a JSON is one that captures have: by its name; a damaged one is the reader's to tell of."""
    return path.name.startswith(("transforms", "info_semantic", "cam_params", "segments", "mesh_info", "metadata"))


def _count(paths: list[Path], word: str) -> str:
    return f"one {word} is" if len(paths) == 1 else f"{len(paths)} {word}s are"


def _other_sentence(name: str, names: list[str]) -> str:
    endings = [Path(file).suffix.lower() for file in names]
    blend = next((file for file, ending in zip(names, endings, strict=True) if ending == ".blend"), None)
    if blend:
        return f"Folder '{name}' holds the Blender file '{blend}' and no scan; open that by File, Open."
    film = next((file for file, ending in zip(names, endings, strict=True) if ending in VIDEOS), None)
    if film:
        return (
            f"Folder '{name}' holds the video '{film}', which has no poses; find them and its frames "
            "(ns-process-data video, or COLMAP), or record by an app that stores poses, such as Stray Scanner."
        )
    if any(ending in (".exr", ".hdr", ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".heic", ".dng") for ending in endings):
        return (
            f"Folder '{name}' holds pictures, but no cameras (such as 'transforms.json' or a COLMAP model); "
            "choose the folder above, or add them."
        )
    if any(ending in (".ply", ".obj", ".glb", ".gltf") for ending in endings):
        return (
            f"Folder '{name}' holds a mesh, but no cameras (such as 'transforms.json' or a COLMAP model); "
            "add them and their frames."
        )
    return f"Folder '{name}' holds no scan: cameras (such as 'transforms.json'), frames and a mesh."
