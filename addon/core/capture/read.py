"""The seam between captures on disk and everything else: a folder in, checked values out.

A further format is one more `Reader` in `READERS`; nothing behind this module learns of it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadInputError
from . import instances, nerfstudio
from .clipping import find_clipping
from .exr import HALF_MAX, read_exr, read_header
from .mesh_repair import repair
from .model import Capture, Frame, Mesh, Pixels
from .ply import read_ply
from .png import png_size, read_png

MESH = "mesh.ply"
MAX_BAD_SHARE = 0.2
"""More bad frames than this share, and the capture is taken as broken instead of the frames as bad."""
LISTED = 3
"""How many problems are told in full."""
NOISE = 1e-4
"""Negative values down to this come from filtering and count as 0."""
OPAQUE = 0.99
"""A pixel of less alpha is a mixture of what was seen and nothing."""


class Reader(NamedTuple):
    """One format of posed frames.

    Attributes
    ----------
    name : str
    wants : str
        The file by which a user knows the format.
    find : callable(root) -> Path or None
        The file of poses where the folder has this format.
    read_frames : callable(root, picture_size) -> (frames, problems, notes)
    """

    name: str
    wants: str
    find: Callable[[Path], Path | None]
    read_frames: Callable[[Path, Callable[[Path], tuple[int, int]]], tuple[list[Frame], list[str], list[str]]]


READERS = (Reader("nerfstudio", nerfstudio.FILES[0], nerfstudio.find, nerfstudio.read_frames),)


def read_capture(folder: Path | str) -> Capture:
    """Read the mesh, the objects and the frames' cameras of a capture, and check them before any long work.

    A bad frame among good ones is left out with a warning.

    Raises
    ------
    BadInputError
        No capture is there, its mesh is unusable, or more than `MAX_BAD_SHARE` of its frames are.
    """
    root = Path(folder)
    if not root.is_dir():
        what = "is a file, not a folder" if root.exists() else "does not exist"
        raise BadInputError(f"Capture '{root}' {what}; give the folder that holds {MESH} and the poses.")
    reader = _reader(root)
    mesh, objects, warnings = _read_mesh(root)
    frames, problems, notes = reader.read_frames(root, read_header)
    warnings += notes
    total = len(frames) + len(problems)
    good = []
    for frame in frames:
        try:
            _check_frame(frame)
        except BadInputError as error:
            problems.append(str(error))
        else:
            good.append(frame)
    if problems:
        few = " ".join(problems[:LISTED]) + (f" And {len(problems) - LISTED} more." if len(problems) > LISTED else "")
        if len(problems) > MAX_BAD_SHARE * total:
            raise BadInputError(f"Capture '{root}' has {len(problems)} bad frames of {total}, too many to leave out; "
                                f"mend these: {few}")
        warnings.append(f"{len(problems)} of {total} frames are left out: {few}")
    if len(good) == 1:
        warnings.append("The capture has a single frame; highlights can't be told from colour, and what it does not "
                        "see stays unknown.")
    clipped, notes = find_clipping(good, lambda path: read_exr(path).rgb)
    return Capture(root, mesh, objects, clipped, tuple(warnings + notes))


def _reader(root: Path) -> Reader:
    for reader in READERS:
        if reader.find(root):
            return reader
    wanted = " or ".join(reader.wants for reader in READERS)
    raise BadInputError(f"Folder '{root}' holds no capture that is known; it needs {wanted}.")


def _read_mesh(root: Path) -> tuple[Mesh, tuple, list[str]]:
    ply, warnings = repair(read_ply(root / MESH), MESH)
    semantic = root / instances.FILE
    names = instances.read_instances(semantic) if semantic.exists() else None
    ids, objects, more = instances.assign(ply.object_id, len(ply.triangles), names)
    return Mesh(ply.vertices, ply.triangles, ids, ply.uv), objects, warnings + more


def _check_frame(frame: Frame) -> None:
    """Look at the headers of a frame's pictures; raises `BadInputError`."""
    wanted = frame.camera.width, frame.camera.height
    sizes = [(frame.path, read_header(frame.path))]
    if frame.mask_path is not None:
        sizes.append((frame.mask_path, read_header(frame.mask_path) if _is_exr(frame.mask_path)
                      else png_size(frame.mask_path)))
    for path, (width, height) in sizes:
        if (width, height) != wanted:
            raise BadInputError(f"Frame '{frame.name}': '{path}' has {width} x {height} pixels, but its camera has "
                                f"{wanted[0]} x {wanted[1]}; give them one size.")


def _is_exr(path: Path) -> bool:
    return path.suffix.lower() == ".exr"


def read_pixels(frame: Frame) -> Pixels:
    """Read what `frame` measured: exposure divided out, masked and impossible pixels marked.

    Raises
    ------
    BadInputError
        A picture is damaged, or of another size than the camera.
    """
    shape = frame.camera.height, frame.camera.width
    rgb, alpha = read_exr(frame.path)
    if rgb.shape[:2] != shape:
        raise BadInputError(f"Frame '{frame.name}': '{frame.path}' changed its size during the run; start again.")
    # A half float overflows to inf: the pixel was bright, but it gives no value at all, not even a bound. Writers that
    # hold what is brighter at a half's end give a bound.
    saturated = ((rgb >= frame.saturation) | (rgb == HALF_MAX) | np.isposinf(rgb)).any(-1)
    seen = np.ones(shape, bool)
    if alpha is not None and (alpha > 0).any():  # some writers leave all of alpha at 0 and mean nothing by it
        seen &= alpha >= OPAQUE
    if frame.mask_path is not None:
        mask = _read_mask(frame.mask_path)
        if mask.shape != shape:
            raise BadInputError(f"Frame '{frame.name}': mask '{frame.mask_path}' differs in size; make it the frame's.")
        seen &= mask
    valid = seen & (np.isfinite(rgb) & (rgb >= -NOISE)).all(-1)
    with np.errstate(over="ignore", invalid="ignore"):
        radiance = np.maximum(rgb, 0) / np.float32(frame.exposure)
        valid &= np.isfinite(radiance).all(-1)
    radiance[~valid] = 0
    return Pixels(radiance.astype(np.float32, copy=False), valid, saturated & seen)


def _read_mask(path: Path) -> np.ndarray:
    """(h, w) bool: False where the mask is black."""
    if _is_exr(path):
        return (read_exr(path).rgb > 0).any(-1)
    pixels = read_png(path)
    return (pixels[..., : 1 if pixels.shape[2] < 3 else 3] > 0).any(-1)


def describe(capture: Capture) -> dict[str, Any]:
    """What the command `info` tells, ready for JSON: counts, sizes in pixels and metres, objects, warnings."""
    counts = dict(zip(*(a.tolist() for a in np.unique(capture.mesh.object_id, return_counts=True))))
    corners = capture.mesh.vertices[capture.mesh.triangles]
    low, high = corners.min((0, 1)), corners.max((0, 1))
    area = float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum())
    sizes: dict[str, int] = {}
    for frame in capture.frames:
        size = f"{frame.camera.width}x{frame.camera.height}"
        sizes[size] = sizes.get(size, 0) + 1
    return {
        "capture": str(capture.root),
        "format": _reader(capture.root).name,
        "triangles": len(capture.mesh.triangles),
        "vertices": len(capture.mesh.vertices),
        "area_m2": area / 2,
        "bounds_m": [low.tolist(), high.tolist()],
        "extent_m": (high - low).tolist(),
        "frames": len(capture.frames),
        "resolutions": sizes,
        "masks": sum(frame.mask_path is not None for frame in capture.frames),
        "instances": [
            {"object_id": one.object_id, "class_name": one.class_name, "triangles": counts.get(one.object_id, 0)}
            for one in capture.instances
        ],
        "warnings": list(capture.warnings),
    }


def fingerprint(capture: Capture) -> str:
    """A hash that changes with the capture: content of mesh, objects and poses; name, size and time of each picture.

    Pictures are not read through: they are most of a capture, and one that was replaced has another time.

    Raises
    ------
    BadInputError
        A file was taken away since the capture was read.
    """
    root = capture.root
    digest = hashlib.sha256()
    try:
        for path in (root / MESH, root / instances.FILE, _reader(root).find(root)):
            if path is not None and path.exists():
                content = path.read_bytes()
                digest.update(f"{path.name} {len(content)}\n".encode())
                digest.update(content)
        for frame in capture.frames:
            for path in (frame.path, frame.mask_path):
                if path is not None:
                    stat = path.stat()
                    name = path.relative_to(root).as_posix()
                    digest.update(f"{name} {stat.st_size} {stat.st_mtime_ns}\n".encode("utf-8", "surrogatepass"))
    except OSError as error:
        raise BadInputError(f"'{error.filename}' was taken away during the run; put it back and start anew.") from error
    return digest.hexdigest()
