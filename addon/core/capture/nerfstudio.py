"""Frames from a nerfstudio `transforms.json`.

A frame that can't be used becomes a problem in a list, so that one bad frame does not hide the next; what is wrong with
the whole file is raised.
"""

from __future__ import annotations

import math
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from ..errors import BadInputError
from . import instances
from .jsonfile import is_number, read_json
from .layout import Layout, Reader, Reading
from .meshes import find_mesh, read_mesh
from .model import Camera, Frame
from .pictures import picture_size
from .pose import check_pose

FILES = ("transforms.json", "transforms_train.json")
MODELS = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE")
DISTORTION = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
ENDING = ".exr"
"""Tried where `file_path` has none, as in the NeRF-synthetic scenes."""


def find(root: Path) -> Path | None:
    """The file of poses in the capture `root`, or None."""
    return next((root / name for name in FILES if (root / name).is_file()), None)


def read(root: Path, reading: Reading) -> Layout:
    """Read the poses, the mesh and the objects' names.

    Raises
    ------
    BadInputError
        The file is not JSON, lists no frames, has distorted frames, or leads out of the capture's folder; the mesh or
        the list of objects can't be read.
    """
    mesh = read_mesh(find_mesh(root, reading), reading)
    semantic = root / instances.FILE
    names = instances.read_instances(semantic) if semantic.exists() else None
    frames, problems, notes = read_frames(root)
    return Layout(frames, mesh, names, instances.FILE, problems, notes)


def read_frames(root: Path) -> tuple[list[Frame], list[str], list[str]]:
    """All frames that the capture `root` lists, sentences on those that can't be used, and on what may mean else."""
    path = find(root) or root / FILES[0]
    top = read_json(path)
    entries = top.get("frames")
    if not isinstance(entries, list) or not entries:
        raise BadInputError(f"'{path}' lists no frames; export the capture again.")
    _check_lens(top, top, path)
    names = [_name(entry, i) for i, entry in enumerate(entries)]
    if len(set(names)) < len(names):  # left/0001 and right/0001: tell them apart by their folders
        names = [str(entry.get("file_path", i)) if isinstance(entry, dict) else str(i)
                 for i, entry in enumerate(entries)]
    frames: list[Frame] = []
    problems: list[str] = []
    seen: set[Path] = set()
    for name, entry in zip(names, entries):
        if not isinstance(entry, dict):
            problems.append(f"Frame '{name}' is no JSON object in '{path}'.")
            continue
        _check_lens(top, entry, path)
        try:
            frame = _frame(root, top, entry, name)
            if frame.path in seen:
                raise BadInputError(f"Frame '{name}' is listed twice; keep the entry with the right pose.")
        except BadInputError as error:
            if isinstance(error, _Escapes):
                raise
            problems.append(str(error))
            continue
        seen.add(frame.path)
        frames.append(frame)
    return frames, problems, _unexposed(top, names, entries)


def _unexposed(top: dict[str, Any], names: list[str], entries: list[Any]) -> list[str]:
    """A sentence where some frames state an exposure and others don't."""
    stated = [isinstance(entry, dict) and entry.get("exposure") is not None for entry in entries]
    if not any(stated) or all(stated) or top.get("exposure") is not None:
        return []
    first = names[stated.index(False)]
    return [f"{stated.count(False)} of {len(stated)} frames state no exposure (the first: '{first}'); it was taken as "
            "1; give each frame its own."]


class _Escapes(BadInputError):
    """A path leads out of the capture's folder: no slip of one frame, so it is told at once."""


def _name(entry: Any, index: int) -> str:
    path = entry.get("file_path") if isinstance(entry, dict) else None
    return (isinstance(path, str) and PurePosixPath(path.replace("\\", "/")).stem) or f"#{index}"


def _check_lens(top: dict[str, Any], entry: dict[str, Any], path: Path) -> None:
    """Raise `BadInputError` where the frames are not those of a pinhole camera."""
    model = entry.get("camera_model", top.get("camera_model", MODELS[0]))
    if model not in MODELS:
        raise BadInputError(f"'{path}' has frames of camera model '{model}', which aren't supported yet; "
                            "undistort them to a pinhole camera.")
    values = [entry.get(name, 0) for name in DISTORTION]
    listed = entry.get("distortion_params")
    values += listed if isinstance(listed, list) else []
    if any(value not in (0, None) for value in values):
        raise BadInputError(f"'{path}' has distorted frames, which aren't supported yet; "
                            "undistort them and set k1 to k6, p1 and p2 to 0.")


def _frame(root: Path, top: dict[str, Any], entry: dict[str, Any], name: str) -> Frame:
    """One frame; raises `BadInputError` where it can't be used."""
    path = _inside(root, entry.get("file_path"), name)
    ended = path.with_name(path.name + ENDING)
    try:
        if not path.is_file() and (not path.suffix or ended.is_file()):
            path = ended
    except (OSError, ValueError) as error:  # a name that the system can't even ask for
        raise BadInputError(f"Frame '{name}' has a file_path that can't be a file; mend it.") from error
    mask = entry.get("mask_path")
    pose = check_pose(entry.get("transform_matrix"), name)
    exposure = _positive(top, entry, "exposure", name, 1.0)
    saturation = _positive(top, entry, "saturation", name, math.inf)
    size = [_positive(top, entry, key, name, None) for key in ("w", "h")]
    if None in size:
        size = list(picture_size(path))
    if any(value != int(value) for value in size):
        raise BadInputError(f"Frame '{name}' has a size of {size[0]} x {size[1]}; give whole pixels as w and h.")
    width, height = (int(value) for value in size)
    fx, fy = _focal_lengths(top, entry, name, width, height)
    centre = [entry.get(key, top.get(key, half)) for key, half in (("cx", width / 2), ("cy", height / 2))]
    if not all(is_number(value) for value in centre):
        raise BadInputError(f"Frame '{name}' has a principal point that is no number; mend its cx and cy.")
    camera = Camera(width, height, fx, fy, float(centre[0]), float(centre[1]), pose)
    mask_path = None if mask in (None, "") else _inside(root, mask, name)
    return Frame(name, path, camera, mask_path, exposure, saturation)


def _focal_lengths(top: dict[str, Any], entry: dict[str, Any], name: str, width: int,
                   height: int) -> tuple[float, float]:
    fx = _positive(top, entry, "fl_x", name, None)
    fy = _positive(top, entry, "fl_y", name, None)
    for key, extent in (("camera_angle_x", width), ("camera_angle_y", height)):
        angle = _positive(top, entry, key, name, None)
        if angle is not None and not angle < math.pi:
            raise BadInputError(f"Frame '{name}' has a {key} of {angle}; give radians below pi.")
        if angle is not None and key == "camera_angle_x":
            fx = fx or extent / 2 / math.tan(angle / 2)
        elif angle is not None:
            fy = fy or extent / 2 / math.tan(angle / 2)
    if fx is None and fy is None:
        raise BadInputError(f"Frame '{name}' has no focal length; give fl_x or camera_angle_x.")
    return fx or fy, fy or fx


def _positive(top: dict[str, Any], entry: dict[str, Any], key: str, name: str, default: float | None) -> float | None:
    """The number `key` of the frame, else of the file, else `default`; raises `BadInputError` unless above 0."""
    value = entry.get(key, top.get(key))
    if value is None or value == math.inf and default == math.inf:
        return default
    if not is_number(value) or not value > 0:
        raise BadInputError(f"Frame '{name}' has {key} = {value!r}; give a number above 0.")
    return float(value)


def _inside(root: Path, value: Any, name: str) -> Path:
    """`value` as a path within `root`."""
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise BadInputError(f"Frame '{name}' names no picture; give its file_path.")
    # Both ways of writing paths: a capture made on the other system must not lead out either.
    for kind in (PurePosixPath, PureWindowsPath):
        path = kind(value)
        if path.is_absolute() or path.drive or path.root or ".." in path.parts:
            raise _Escapes(f"Frame '{name}' has the path '{value}', which leads out of the capture '{root}'; "
                           "give paths within it.")
    return root / PurePosixPath(value.replace("\\", "/"))


READER = Reader("nerfstudio", FILES[0], lambda root: find(root) is not None, read)
