"""The layout of ScanNet++ (Yeshwanth et al., ICCV 2023): a laser scan, its annotation, and the DSLR's pictures.

`scans/mesh_aligned_0.05.ply`; `scans/segments.json` with a segment for each vertex, `scans/segments_anno.json` with the
objects' segments; `dslr/colmap`, whose world is the scan's; `dslr/resized_images` (fisheye), or undistorted ones with
the pinhole camera of `dslr/nerfstudio/transforms_undistorted.json`. Its own pictures are 8-bit: their curve has to be
given, or EXR put beside or in place of them. The views that `dslr/train_test_lists.json` calls 'test' are kept out.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..scene.model import Frame
from . import colmap
from .camera_check import pinhole
from .colmap_model import model_files, read_model
from .files import read_json
from .formats import FORMATS
from .instances import MAX_ID
from .layout import Layout, RawMesh, Reader, Reading
from .meshes import read_mesh

MESH, SEGMENTS, OBJECTS = "scans/mesh_aligned_0.05.ply", "scans/segments.json", "scans/segments_anno.json"
MODEL, LISTS, POSES = "dslr/colmap", "dslr/train_test_lists.json", "dslr/nerfstudio/transforms.json"
PINHOLE = "dslr/nerfstudio/transforms_undistorted.json"


PICTURES = (
    ("dslr/resized_images", "dslr/resized_anon_masks", False),
    ("dslr/resized_undistorted_images", "dslr/resized_undistorted_masks", True),
    ("dslr/undistorted_images", "dslr/undistorted_anon_masks", True),
)
"""Folders of pictures, those of their masks, and whether the lens was taken out."""


def read(root: Path, reading: Reading) -> Layout:
    """Read the mesh with its objects and the frames, as `layout.Reader` has it."""
    mesh = read_mesh(reading.mesh or root / MESH, reading)
    names = None
    if reading.mesh is None and (root / SEGMENTS).exists() and (root / OBJECTS).exists():
        ids, names = objects_of(root, mesh)
        mesh = replace(mesh, object_id=ids)
    folder, masks, is_pinhole = _pictures(root)
    frames, problems, notes = colmap.frames_of(read_model(root / MODEL), root, root / folder, reading)
    if is_pinhole and frames:
        frames = _undistorted(frames, root)
    frames, more = _chosen(frames, root)
    frames = [_masked(frame, root / folder, root / masks) for frame in frames]
    return Layout(frames, mesh, names, OBJECTS, problems, notes + more)


def _pictures(root: Path) -> tuple[str, str, bool]:
    """The entry of `PICTURES` with HDR pictures; else the first that is there."""
    present = [entry for entry in PICTURES if (root / entry[0]).is_dir()]
    if not present:
        raise BadInputError(f"Capture '{root}' has no pictures; put them into '{root / PICTURES[0][0]}'.")
    hdr = (e for e in present if any(path.suffix.lower() in colmap.HDR for path in (root / e[0]).iterdir()))
    return next(hdr, present[0])


def objects_of(root: Path, mesh: RawMesh) -> tuple[np.ndarray, dict[int, str]]:
    """The object of each triangle ((t,) int64, -1: none) and the objects' labels.

    A vertex of several objects is taken as the smallest's; a triangle has the object of most of its corners.
    """
    values = read_json(root / SEGMENTS).get("segIndices")
    try:
        segment = np.array(values if isinstance(values, list) else [], np.int64)
    except (TypeError, ValueError, OverflowError):
        segment = np.zeros(0, np.int64)
    if segment.shape != (len(mesh.vertices),):
        raise BadInputError(
            f"'{root / SEGMENTS}' does not name a segment for each of the {len(mesh.vertices)} vertices"
            f" of '{mesh.name}'; copy both from the same scan."
        )
    groups = read_json(root / OBJECTS).get("segGroups")
    if not isinstance(groups, list):
        raise BadInputError(f"'{root / OBJECTS}' has no list 'segGroups'; copy it again.")
    kinds, place = np.unique(segment, return_inverse=True)
    size = np.bincount(place)
    names: dict[int, str] = {}
    members = []
    for i, group in enumerate(groups):
        number, segments = _group(group, i, root)
        if number in names:
            raise BadInputError(f"'{root / OBJECTS}' lists the object {number} twice; copy it again.")
        names[number] = str(group.get("label") or f"object_{number}")
        indices = np.flatnonzero(np.isin(kinds, segments))
        members.append((int(size[indices].sum()), number, indices))
    of_segment = np.full(len(kinds), -1, np.int64)
    for _, number, indices in sorted(members, key=lambda member: -member[0]):
        of_segment[indices] = number
    corner = of_segment[place][mesh.triangles]
    return np.where(corner[:, 1] == corner[:, 2], corner[:, 1], corner[:, 0]), names


def _group(group: Any, i: int, root: Path) -> tuple[int, list[int]]:
    number = group.get("objectId", group.get("id")) if isinstance(group, dict) else None
    segments = group.get("segments") if isinstance(group, dict) else None
    good = isinstance(segments, list) and all(isinstance(segment, int) and abs(segment) < 2**62 for segment in segments)
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number <= MAX_ID or not good:
        raise BadInputError(
            f"'{root / OBJECTS}' has an object (number {i}) without a whole 'objectId' and a list of "
            "'segments'; copy it again."
        )
    return number, list(segments or ())


def _undistorted(frames: list[Frame], root: Path) -> list[Frame]:
    path = root / PINHOLE
    camera = pinhole(read_json(path), ("w", "h", "fl_x", "fl_y", "cx", "cy"), path)
    return [replace(frame, camera=replace(camera, camera_to_world=frame.camera.camera_to_world)) for frame in frames]


def _chosen(frames: list[Frame], root: Path) -> tuple[list[Frame], list[str]]:
    """The frames that are neither kept out for tests nor called bad, and sentences on those left out."""
    notes = []
    for path, what, names in ((root / LISTS, "are kept out for tests", _tests), (root / POSES, "are blurred", _bad)):
        if path.is_file():
            out = names(read_json(path))
            left = [frame for frame in frames if frame.path.stem not in out]
            if not left and frames:
                raise BadInputError(f"'{path}' leaves none of the {len(frames)} frames; copy it again.")
            if len(left) < len(frames):
                notes.append(f"{len(frames) - len(left)} of {len(frames)} frames {what}, by {path.name}.")
            frames = left
    return frames, notes


def _tests(top: dict[str, Any]) -> set[str]:
    listed = top.get("test")
    return {Path(name).stem for name in listed if isinstance(name, str)} if isinstance(listed, list) else set()


def _bad(top: dict[str, Any]) -> set[str]:
    listed = top.get("frames")
    frames = [frame for frame in listed if isinstance(frame, dict)] if isinstance(listed, list) else []
    return {Path(str(frame.get("file_path"))).stem for frame in frames if frame.get("is_bad")}


def _masked(frame: Frame, folder: Path, masks: Path) -> Frame:
    """The frame with its mask, where one is there: people and faces made unknown."""
    path = (masks / frame.path.relative_to(folder)).with_suffix(".png") if frame.path.is_relative_to(folder) else masks
    return replace(frame, mask_path=path) if path.is_file() else frame


READER = Reader(
    "scannet++", FORMATS["scannet++"], lambda root: (root / MESH).is_file() and bool(model_files(root / MODEL)), read
)
