"""From a folder to a checked `Capture`: what all formats have in common."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError, one_line
from ..kinds import Limit, Shown
from ..scene.closing import Closing, close_holes
from ..scene.model import Capture, Frame, Mesh, Pixels
from ..scene.shape_parts import parts_of
from ..scene.vote import vote
from . import instances
from .brackets import fold, group_brackets, unfold
from .camera_check import check_camera, check_size
from .clipping import find_clipping
from .conventions import parse, upright
from .exposures import from_csv, from_exif
from .files import absence, check_links
from .folder import VIDEOS
from .formats import SHAPE
from .frame_codes import with_curves
from .id_pictures import check_ids, read_ids
from .layout import AS_FOUND, Layout, RawMesh, Reading, usable
from .mesh_repair import repair
from .orientation import oriented
from .part import apart, part_in
from .picture import too_few_bytes
from .pictures import picture_note, picture_size, read_picture
from .pixels import read_pixels
from .readers import reader_for
from .segments import check_segments, laid_on

MAX_BAD_SHARE: Limit[float] = 0.2
"""More bad frames than this share, and the capture is taken as broken instead of the frames as bad."""
LISTED: Shown[int] = 3
"""How many problems are told in full."""


def read_capture(folder: Path | str, reading: Reading = AS_FOUND) -> Capture:
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
        raise BadInputError(f"Capture '{root}' {what}; give the folder that holds the mesh and the poses.")
    check_segments(reading.segments)  # before a video is read through
    part, source = part_in(root), root
    if part is not None:
        reading, source = part.reading_of_whole(reading), part.whole
    reader = reader_for(source, reading.format)
    layout = reader.read(source, reading)
    if part is not None:
        layout = part.taken(layout, reading)
    layout = laid_on(layout, reading.segments, root)
    listed = root / instances.FILE
    if layout.names is None and listed.exists():
        layout = replace(layout, names=instances.read_instances(listed), names_file=instances.FILE)
    # Told before any header is looked at: of a hundred thousand frames that takes minutes.
    missing = [(frame.path, what) for frame in layout.frames if (what := absence(frame.path))]
    absent = [f"Picture '{path}' {what}; check the capture's paths." for path, what in missing]
    _refuse_too_many(root, layout, [*layout.problems, *absent])
    convention = parse(reading.convention)
    layout = replace(layout, frames=convention.frames(layout.frames), mesh=convention.mesh(layout.mesh))
    frames, more = _usable(source, _exposed(layout, reading), reading.outside)
    frames, grouped = group_brackets(frames)
    mesh, objects, warnings = _objects(layout, frames, reading.segments == SHAPE)
    if layout.names is not None and reading.segments != SHAPE and Path(layout.names_file).name == instances.FILE:
        objects, notes = instances.with_parts(objects, root / layout.names_file)
        warnings += notes
    mesh, objects = apart(mesh, objects)
    clipped, notes = find_clipping(unfold(frames), lambda path: read_picture(path).rgb)
    frames = fold(frames, clipped)
    notes = [*grouped, *_chosen(frames), *notes]
    known = {instance.object_id for instance in objects}
    turn = upright(convention.up)
    mirrors = tuple(
        replace(mirror, point=turn @ mirror.point, normal=turn @ mirror.normal)
        for mirror in layout.mirrors
        if mirror.object_id in known
    )
    messages = tuple(one_line(text) for text in (*warnings, *more, *notes))
    return Capture(root, mesh, objects, tuple(frames), messages, reader.name, mirrors)


def _exposed(layout: Layout, reading: Reading) -> Layout:
    """The layout with each frame's exposure, curve and orientation as the user or the pictures themselves tell."""
    frames, turned = oriented(layout.frames)
    problems: list[str] = []
    if reading.exposures is not None:
        frames, problems, notes = from_csv(frames, reading.exposures)
    else:
        frames, notes = from_exif(frames)
    frames, more, curves = with_curves(frames, reading.transfer)
    return replace(
        layout,
        frames=frames,
        problems=[*layout.problems, *problems, *more],
        notes=[*layout.notes, *turned, *notes, *curves],
    )


def _chosen(frames: list[Frame]) -> list[str]:
    """A sentence for each way in which one of several pictures in a file was chosen."""
    counts = Counter(note for note in (picture_note(frame.path) for frame in frames) if note)
    return [f"Taken in {count} of {len(frames)} frames: {note}." for note, count in counts.items()]


def _objects(layout: Layout, frames: list[Frame], by_shape: bool) -> tuple[Mesh, tuple, list[str]]:
    """The mesh repaired, with an instance for each of its triangles.

    What tells the objects: segments, the mesh's faces, objects or groups; else pictures of ids; else its shape, which
    the user may want (`by_shape`).
    """
    raw, warnings = repair(layout.mesh)
    count = len(raw.triangles)
    names = layout.names if layout.names is not None else raw.names
    object_id = raw.object_id
    has_objects = object_id is not None or any(frame.id_path is not None for frame in frames)
    if object_id is None and has_objects:
        object_id, notes = vote(raw.vertices, raw.triangles, frames, _ids)
        warnings += notes
    elif object_id is None:
        parts = parts_of(raw.vertices, raw.triangles)
        object_id, names = parts.part, parts.names
        reason = "" if by_shape else "Nothing tells the mesh's objects: its faces have no object_id. "
        warnings.append(
            f"{reason}By its shape the mesh has {len(names)} objects; none of them is taken for metal or glass unless "
            "you say so."
        )
        if frames and parts.planes:
            added = close_holes(raw.vertices, raw.triangles, parts, frames, _pixels)
            raw, object_id, names = _with(raw, added), np.concatenate([object_id, added.part]), added.names
    ids, objects, more = instances.assign(object_id, names, layout.names_file or instances.FILE)
    if not has_objects:
        objects = tuple(replace(instance, guess=True) for instance in objects)
    closed = np.arange(count, len(raw.triangles), dtype=np.int32)
    lit = None if frames else raw.lit
    mesh = Mesh(
        raw.vertices, raw.triangles, ids, raw.uv, lit, closed=closed if len(closed) else None, whole=not has_objects,
        far=raw.far,
    )  # fmt: skip
    return mesh, objects, warnings + more


def _ids(frame: Frame) -> np.ndarray:
    check_ids(frame)
    return read_ids(frame)


def _pixels(frame: Frame) -> Pixels:
    """What a frame measured; nothing where it is damaged, which is told once it is needed."""
    try:
        return read_pixels(frame)
    except BadInputError:
        shape = frame.camera.height, frame.camera.width
        return Pixels(np.zeros((*shape, 3), np.float32), np.zeros(shape, bool), np.zeros(shape, bool))


def _with(mesh: RawMesh, added: Closing) -> RawMesh:
    triangles = np.concatenate([mesh.triangles, added.triangles + len(mesh.vertices)]).astype(np.int32)
    uv = None if mesh.uv is None else np.concatenate([mesh.uv, np.zeros((len(added.triangles), 3, 2), np.float32)])
    far = None if mesh.far is None else np.concatenate([mesh.far, np.zeros(len(added.triangles), bool)])
    return replace(mesh, vertices=np.concatenate([mesh.vertices, added.vertices]), triangles=triangles, uv=uv, far=far)


def _usable(root: Path, layout: Layout, outside: bool) -> tuple[list[Frame], list[str]]:
    """The frames whose pictures are there and fit their cameras, and sentences on the others."""

    def checked(frame: Frame) -> Frame:
        if not outside:
            check_links(root, frame.name, frame.files)
        _check_frame(frame)
        return frame

    good, more = usable(checked, layout.frames)
    problems, warnings = [*layout.problems, *more], list(layout.notes)
    if problems:
        total, few = _refuse_too_many(root, layout, problems)
        warnings.append(f"{len(problems)} of {total} frames are left out: {few}")
    if len(good) == 1:
        warnings.append(
            "The capture has a single frame; highlights can't be told from colour, and what it does not "
            "see stays unknown."
        )
    return good, warnings


def _refuse_too_many(root: Path, layout: Layout, problems: list[str]) -> tuple[int, str]:
    """How many frames there are, and the first of their `problems`; raises `BadInputError` where these are too many."""
    total = len(layout.frames) + len(layout.problems)
    few = " ".join(problems[:LISTED]) + (f" And {len(problems) - LISTED} more." if len(problems) > LISTED else "")
    if len(problems) > MAX_BAD_SHARE * total:
        videos = sorted(path.name for path in root.iterdir() if path.suffix.lower() in VIDEOS)
        if videos and not layout.frames:
            few += (
                f" Poses don't tell which frames of '{videos[0]}' they are of: run again what took pictures out of it."
            )
        raise BadInputError(
            f"Capture '{root}' has {len(problems)} bad frames of {total}, too many to leave out; mend these: {few}"
        )
    return total, few


def _check_frame(frame: Frame) -> None:
    """Look at a frame's camera and at the headers of its pictures; raises `BadInputError`."""
    check_camera(frame.camera, frame.name)
    shots = [shot.path for shot in frame.shots]
    for path in filter(None, (*shots, frame.mask_path)):
        width, height = picture_size(path, frame.turned and path in shots)
        size = path.stat().st_size
        if path in shots and too_few_bytes(width, height, size):
            raise BadInputError(
                f"Frame '{frame.name}': '{path}' claims {width} x {height} pixels in {size} bytes, fewer than any "
                "camera's picture takes; give the picture as it was taken or rendered."
            )
        check_size(frame, path, (width, height))


def describe(capture: Capture) -> dict[str, Any]:
    """What the command `info` tells, ready for JSON: counts, sizes in pixels and metres, objects, warnings."""
    mesh = replace(capture.mesh)  # whose normals are not needed any more afterwards
    counts = dict(zip(*(a.tolist() for a in np.unique(mesh.object_id, return_counts=True))))
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.triangles] = True
    places = mesh.vertices[used]
    low, high = places.min(0), places.max(0)
    cameras = [frame.camera for frame in capture.frames]
    exposures = sorted(frame.exposure for frame in unfold(capture.frames))
    return {
        "capture": str(capture.root),
        "format": capture.format,
        "triangles": len(mesh.triangles),
        "vertices": len(mesh.vertices),
        "area_m2": float(mesh.geometry[1].sum()),
        "bounds_m": [low.tolist(), high.tolist()],
        "extent_m": (high - low).tolist(),
        "frames": len(capture.frames),
        "resolutions": dict(Counter(f"{camera.width}x{camera.height}" for camera in cameras)),
        "lenses": dict(Counter("PINHOLE" if camera.lens is None else camera.lens.name for camera in cameras)),
        "exposures": [exposures[0], exposures[-1]] if exposures else [],
        "bracketed_frames": sum(bool(frame.brackets) for frame in capture.frames),
        "curve_of_codes": next((frame.transfer for frame in capture.frames if frame.transfer), ""),
        "masks": sum(frame.mask_path is not None for frame in capture.frames),
        "instances": [
            {
                "object_id": instance.object_id,
                "class_name": instance.class_name,
                "triangles": counts.get(instance.object_id, 0),
            }
            for instance in capture.instances
        ],
        "warnings": list(capture.warnings),
    }
