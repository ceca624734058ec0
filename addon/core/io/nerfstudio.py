"""Captures in nerfstudio's layout: `transforms.json`, or the split files of the NeRF-synthetic scenes.

A frame that can't be used becomes a problem in a list, so that one bad frame does not hide the next; what is wrong with
the whole file is raised.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..json_values import is_number
from ..kinds import Code
from ..scene.model import Frame, Shot
from ..scene.pose import check_pose
from .conventions import AS_READ
from .exposures import EXPOSURE, Settings, from_settings, settings_of
from .files import check_picture, inside, read_json
from .formats import FORMATS
from .layout import Layout, RawMesh, Reader, Reading, usable
from .meshes import MESH, find_mesh, read_mesh
from .nerfstudio_camera import Entry, check_model, lens_notes, read_camera
from .pictures import ENDINGS

FILE = "transforms.json"
SPLITS = ("transforms_train.json", "transforms_val.json")
"""Read one after the other where `FILE` is absent; the test split is left alone."""
TEST_SPLIT = "transforms_test.json"
COLMAP_TO_NERFSTUDIO: Code[list[list[float]]] = [[0.0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0]]
"""What nerfstudio did to COLMAP's world before it wrote down `applied_transform`."""
MOST_INSIDE, FEW_INSIDE = 0.9, 0.1
"""The mesh counts as one of the original world where its box holds more than `MOST_INSIDE` of the cameras when moved to
the poses' world, and fewer than `FEW_INSIDE` otherwise."""


def find(root: Path) -> list[Path]:
    """The files of poses in the capture `root`."""
    if (root / FILE).is_file():
        return [root / FILE]
    return [root / name for name in SPLITS if (root / name).is_file()]


def read(root: Path, reading: Reading) -> Layout:
    """Read the poses and the mesh, as `layout.Reader` has it."""
    paths = find(root) or [root / FILE]
    top = read_json(paths[0])
    mesh = read_mesh(_mesh_path(root, top, reading), reading)
    frames, problems, notes = read_frames(root, reading)
    mesh, more = _in_frames_world(mesh, root, top, frames, reading)
    return Layout(frames, mesh, problems=problems, notes=notes + more)


def read_frames(root: Path, reading: Reading) -> tuple[list[Frame], list[str], list[str]]:
    """All frames that the capture `root` lists, sentences on those that can't be used, and on what may mean else."""
    listed: list[Entry] = []
    problems: list[str] = []
    notes: list[str] = []
    for path in find(root) or [root / FILE]:
        top = read_json(path)
        items = top.get("frames")
        if not isinstance(items, list) or not items:
            raise BadInputError(f"'{path}' lists no frames; export the capture again.")
        problems += [
            f"Frame '#{i}' is no JSON object in '{path}'."
            for i, entry in enumerate(items)
            if not isinstance(entry, dict)
        ]
        entries = [Entry(top, entry, _name(entry, i)) for i, entry in enumerate(items) if isinstance(entry, dict)]
        entries, remarks = _without_test(top, entries)
        for entry in entries:
            check_model(entry, path)
        listed += entries
        notes += remarks + _unexposed(top, entries) + _orientation(top) + lens_notes(entries)
    if (root / TEST_SPLIT).is_file() and not (root / FILE).is_file():
        notes.append(f"The frames of '{TEST_SPLIT}' were left out; put those to be used into '{FILE}'.")
    names = {entry.name for entry in listed}
    if len(names) < len(listed):  # left/0001 and right/0001: tell them apart by their folders
        listed = [replace(entry, name=str(entry.own.get("file_path", i))) for i, entry in enumerate(listed)]
    used: dict[Path, Entry] = {}

    def frame(entry: Entry) -> Frame:
        made = _frame(root, entry, reading)
        if made.path in used:
            raise BadInputError(f"Frame '{entry.name}' is listed twice; keep the entry with the right pose.")
        used[made.path] = entry
        return made

    frames, more = usable(frame, listed)
    frames, remarks = _with_settings(frames, list(used.values()))
    return frames, problems + more, list(dict.fromkeys(notes + remarks))


def _without_test(top: dict[str, Any], entries: list[Entry]) -> tuple[list[Entry], list[str]]:
    """The entries without those that are for testing alone (`test_filenames`), and a sentence on them."""

    def split(key: str) -> set[str]:
        value = top.get(key)
        return {_plain(v) for v in value if isinstance(v, str)} if isinstance(value, list) else set()

    test = split("test_filenames") - split("train_filenames")
    others = [entry for entry in entries if _plain(str(entry.own.get("file_path"))) not in test]
    if not others or len(others) == len(entries):
        return entries, []
    return others, [
        f"{len(entries) - len(others)} of {len(entries)} frames are listed in 'test_filenames' and were left "
        "out; take them out of that list to use them."
    ]


def _plain(path: str) -> str:
    return PurePosixPath(path.replace("\\", "/")).as_posix()


def _unexposed(top: dict[str, Any], entries: list[Entry]) -> list[str]:
    """A sentence where some frames state an exposure and others don't."""
    stated = [entry.own.get("exposure") is not None for entry in entries]
    if not any(stated) or all(stated) or top.get("exposure") is not None:
        return []
    return [
        f"{stated.count(False)} of {len(stated)} frames state no exposure (the first: "
        f"'{entries[stated.index(False)].name}'); it was taken as 1; give each frame its own."
    ]


def _orientation(top: dict[str, Any]) -> list[str]:
    """A sentence where nerfstudio itself would turn the world before it uses it."""
    method = top.get("orientation_override")
    if method in (None, "none"):
        return []
    return [
        f"The file asks nerfstudio to turn the world upright ('orientation_override' is '{method}'); the poses "
        "were taken as stored, with +Z up."
    ]


def _name(entry: dict[str, Any], index: int) -> str:
    path = entry.get("file_path")
    return (isinstance(path, str) and PurePosixPath(path.replace("\\", "/")).stem) or f"#{index}"


def _frame(root: Path, entry: Entry, reading: Reading) -> Frame:
    name, mask = entry.name, entry.own.get("mask_path")
    path = _ended(inside(root, entry.own.get("file_path"), name, reading.outside), name)
    check_picture(path)  # first: of a hundred thousand frames the rest takes many seconds
    pose = check_pose(entry.own.get("transform_matrix"), name)
    exposure, saturation = entry.positive("exposure", 1.0), entry.positive("saturation", math.inf)
    camera = read_camera(entry, path, pose)
    mask_path = None if mask in (None, "") else inside(root, mask, name, reading.outside)
    brackets = _brackets(root, entry, reading.outside)
    return Frame(name, path, camera, mask_path, exposure, saturation, brackets=brackets)


def _ended(path: Path, name: str) -> Path:
    """`path`, or with the ending that it lacks, as in the NeRF-synthetic scenes."""
    try:
        if path.is_file() or path.suffix.lower() in ENDINGS:
            return path
        files = [full for full in (path.with_name(path.name + ending) for ending in ENDINGS) if full.is_file()]
    except (OSError, ValueError) as error:  # a name that the system can't even ask for
        raise BadInputError(f"Frame '{name}' has a file_path that can't be a file; mend it.") from error
    if files:
        return files[0]
    return path if path.suffix else path.with_name(path.name + ENDINGS[0])


# What is told of exposures: our own keys, and those that cameras' settings go by


def _brackets(root: Path, entry: Entry, outside: bool) -> tuple[Shot, ...]:
    """Further exposures of a frame: its `brackets`, a list of {file_path, exposure, saturation}."""
    listed, name = entry.own.get("brackets"), entry.name
    if listed in (None, []):
        return ()
    if not isinstance(listed, list) or not all(isinstance(bracket, dict) for bracket in listed):
        raise BadInputError(
            f"Frame '{name}' has brackets that are no list of objects; give file_path and exposure of each."
        )
    if any(bracket.get(EXPOSURE) is None for bracket in listed):
        raise BadInputError(f"Frame '{name}' has brackets without an exposure; give each its own.")
    saturation = {"saturation": entry.get("saturation")}
    return tuple(
        Shot(
            _ended(inside(root, bracket.own.get("file_path"), name, outside), name),
            bracket.positive(EXPOSURE, 1.0),
            bracket.positive("saturation", math.inf),
        )
        for bracket in (Entry(saturation, keys, name) for keys in listed)
    )


def _with_settings(frames: Sequence[Frame], entries: Sequence[Entry]) -> tuple[list[Frame], list[str]]:
    """As `exposures.from_settings`, by what each frame's entry tells, unless any of them states an exposure."""
    if any(keys.get(EXPOSURE) is not None for entry in entries for keys in (entry.top, entry.own)):
        return list(frames), []
    return from_settings(frames, [_settings(entry) for entry in entries], "the camera's settings in the poses' file")


def _settings(entry: Entry) -> Settings | None:
    """What the camera was set to; None also where what is told is no number (`auto`)."""
    try:
        return settings_of(entry.own, entry.name)
    except BadInputError:
        return None


# The mesh's world


def applied(root: Path, top: dict[str, Any]) -> np.ndarray | None:
    """From the original world to that of the poses (`applied_transform`, `applied_scale`), (4, 4); None: the same.

    Raises `BadInputError` where they are no matrix and no number.
    """
    matrix = top.get("applied_transform")
    if matrix is None and (root / "colmap/sparse/0").is_dir():
        matrix = COLMAP_TO_NERFSTUDIO
    scale = top.get("applied_scale", 1.0)
    try:
        result = np.eye(4)
        if matrix is not None:
            rows = np.array(matrix, np.float64)
            if rows.shape not in ((3, 4), (4, 4)):
                raise ValueError
            result[:3] = rows[:3]
        if not is_number(scale) or not scale > 0 or not np.isfinite(result).all():
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        raise BadInputError(
            f"'{FILE}' in '{root}' has an applied_transform that is no 3 x 4 matrix, or an "
            "applied_scale that is no number above 0; mend or remove them."
        ) from None
    result[:3] *= scale
    return None if np.array_equal(result, np.eye(4)) else result


def _in_frames_world(
    mesh: RawMesh, root: Path, top: dict[str, Any], frames: list[Frame], reading: Reading
) -> tuple[RawMesh, list[str]]:
    """The mesh in the world of the poses, and a sentence where that is not plain.

    nerfstudio writes its own point cloud in the poses' world, and so a mesh is expected there; one that was made by
    COLMAP itself is not, and is moved as the file says where the cameras leave no doubt. The convention 'as-read' keeps
    it where it is; others come on top.
    """
    matrix = applied(root, top)
    if matrix is None or not len(mesh.vertices):
        return mesh, []
    moved = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    if reading.convention != AS_READ and frames:
        after, before = (_within(vertices, frames) for vertices in (moved, mesh.vertices))
        if after > MOST_INSIDE and before < FEW_INSIDE:
            return replace(mesh, vertices=moved), [
                f"'{mesh.name}' was moved from the original world to the poses' by 'applied_transform': {after:.0%} of "
                f"the cameras are then within its box, and {before:.0%} else; --convention {AS_READ} leaves it."
            ]
    if top.get("applied_transform") is None and top.get("applied_scale") is None:
        return mesh, []
    return mesh, [
        f"The poses were moved by 'applied_transform' or 'applied_scale'; '{mesh.name}' was taken to have "
        "been moved with them."
    ]


def _within(vertices: np.ndarray, frames: list[Frame]) -> float:
    """Share of the cameras that are within the vertices' box."""
    low, high = vertices.min(0), vertices.max(0)
    centres = np.array([frame.camera.centre for frame in frames])
    return float(((centres >= low) & (centres <= high)).all(1).mean())


def _mesh_path(root: Path, top: dict[str, Any], reading: Reading) -> Path:
    """As `find_mesh`; where it finds none, the file of `ply_file_path`."""
    try:
        path = find_mesh(root, reading)
    except BadInputError:
        named = top.get("ply_file_path")
        if not isinstance(named, str):
            raise
        path = inside(root, named, MESH, reading.outside)
        if not path.is_file():
            raise
    return path


READER = Reader("nerfstudio", FORMATS["nerfstudio"], lambda root: bool(find(root)), read)
