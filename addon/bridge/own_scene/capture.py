"""The open scene as a capture folder: objects, cameras and the pictures behind them.

The folder has nerfstudio's layout, so any reader of that takes it. Two more files are for writing materials back:
`scene.json` (the object of each instance) and `faces.npz` (the face corners of each triangle).
"""

import json
import os
import shutil
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from zipfile import BadZipFile

import bpy
import numpy as np

from ...core.errors import BadInputError, MissingStageError
from ...core.io.layout import RawMesh
from ...core.io.mesh_repair import repair
from ...core.io.nerfstudio_camera import OWN_LENS
from ...core.io.ply import ply_bytes
from ...core.scene.lens_json import lens_to_json
from ...core.scene.model import Mesh
from ..data.unwrap import Polygons
from ..refused import MAX_LISTED, sentences, whole_folder
from . import cameras as scene_cameras
from .mesh import SceneMesh, SceneObject, gather, joined

OBJECTS, FACES = "scene.json", "faces.npz"


@dataclass(frozen=True)
class Source:
    """The object of the scene, or the part of it, that an instance of the capture was made of.

    Attributes
    ----------
    name, whole : str
        Its name and the whole object's, as displayed to the artist.
    thing : str
        Name of the object that shows it, at the time of capture.
    own, topology
        See `own_scene.mesh.SceneObject`; of the whole object.
    corner_start : int
        First of the object's corners in `faces.npz`.
    slot, face_set, part_of : int or None
        See `own_scene.segments.Segment`.
    """

    object_id: int
    name: str
    thing: str
    own: bool
    topology: str
    corner_start: int
    slot: int | None = None
    face_set: int | None = None
    part_of: int | None = None
    whole: str = ""


def capture_scene(
    context: bpy.types.Context,
    folder: Path | str,
    objects: Iterable[bpy.types.Object],
    mode: str = scene_cameras.AUTO,
    first: int | None = None,
    last: int | None = None,
    step: int = 1,
) -> tuple[str, ...]:
    """Write objects and cameras of the open scene as a capture; the scene stays as it is.

    Parameters
    ----------
    folder : Path or str
        Replaced as a whole where it holds an earlier capture of a scene.
    objects : iterable of bpy.types.Object
        Their surfaces become the mesh; where there are cameras among them, only those are used.
    mode, first, last, step
        See `own_scene.cameras.views`.

    Returns
    -------
    tuple of str
        Warnings, one sentence each.

    Raises
    ------
    BadInputError, StorageError
        No object with faces, no usable picture, or `folder` holds something else; it can't be written.
    """
    folder, scene = Path(folder).absolute(), context.scene
    if folder.exists() and not (folder / OBJECTS).is_file() and any(folder.iterdir()):
        raise BadInputError(f"Folder '{folder}' holds something else already; choose another.")
    objects = sorted(objects, key=lambda obj: obj.name)
    cameras = scene_cameras.cameras_with_pictures(scene, objects)
    if not cameras:
        raise BadInputError(
            "No camera has a picture behind it; give each camera its frame as a background image, or "
            "one animated camera a sequence (Camera, Background Images)."
        )
    scene_objects = gather(context.evaluated_depsgraph_get(), objects)
    if not scene_objects:
        raise BadInputError("No object with faces is selected; select the room's objects first.")
    mesh = joined(scene_objects)
    # Only the triangles that the reader will keep, so that its triangles are the file's, one by one.
    raw = RawMesh(mesh.vertices, mesh.triangles, np.arange(len(mesh.triangles)), name="of the scene")
    indices = repair(raw)[0].object_id
    polygons = mesh.polygons._replace(corner=mesh.polygons.corner[indices])
    mesh = replace(mesh, triangles=mesh.triangles[indices], object_id=mesh.object_id[indices], polygons=polygons)
    problems: list[str] = []
    current_frame = scene.frame_current, scene.frame_subframe
    try:
        depsgraph = context.evaluated_depsgraph_get()
        views = list(scene_cameras.views(scene, depsgraph, cameras, problems, mode, first, last, step))
    finally:
        if (scene.frame_current, scene.frame_subframe) != current_frame:
            scene.frame_set(current_frame[0], subframe=current_frame[1])
    omitted = len(problems) - MAX_LISTED
    message = " ".join(problems[:MAX_LISTED]) + (f" And {omitted} more." if omitted > 0 else "")
    if not views:
        raise BadInputError(f"None of the pictures can be used: {message}")
    metre = scene.unit_settings.scale_length if scene.unit_settings.system != "NONE" else 1.0
    with whole_folder(folder, f"The scene can't be captured into '{folder}'") as part:
        _write(part, mesh, scene_objects, views, metre)
    count = len(problems) + len(views)
    left_out = (f"{len(problems)} of {count} pictures are left out: {message}",) if problems else ()
    return left_out + _write_back_warnings(scene_objects)


def _write_back_warnings(scene_objects: list[SceneObject]) -> tuple[str, ...]:
    """Warnings about objects that materials can't be written back to directly."""
    generated = [entry.name for entry in scene_objects if not entry.own]
    linked = [entry.name for entry in scene_objects if entry.own and (entry.obj.library or entry.obj.override_library)]
    local = "make it local first (Object, Relations, Make Local)"
    return sentences(
        (generated, "modifiers or instances make the faces, so the materials can only go onto a copy"),
        (linked, f"linked from another file, so the materials can't go there; {local}"),
    )


def _write(
    folder: Path, mesh: SceneMesh, scene_objects: list[SceneObject], views: list[scene_cameras.View], unit_scale: float
) -> None:
    (folder / "mesh.ply").write_bytes(ply_bytes(mesh.vertices * unit_scale, [(mesh.triangles, mesh.object_id)]))
    names, entries = [], []
    for scene_object in scene_objects:
        owner = scene_object.obj.name, scene_object.own, scene_object.topology
        for segment in scene_object.segments:
            part_of = {} if segment.part_of is None else {"part_of": segment.part_of}
            names.append({"id": segment.object_id, "class_name": segment.class_name, "name": segment.name} | part_of)
            start, part = mesh.corner_start[segment.object_id], (segment.slot, segment.face_set, segment.part_of)
            entries.append(asdict(Source(segment.object_id, segment.name, *owner, start, *part, scene_object.name)))
    _write_json(folder / "info_semantic.json", {"objects": names})
    (folder / "images").mkdir()
    frames = []
    for view in views:
        file_path, camera, pose = f"images/{view.name}.exr", view.camera, view.camera.camera_to_world.copy()
        link_or_copy(view.path, folder / file_path)
        pose[:3, 3] *= unit_scale
        frame = {"file_path": file_path, "w": camera.width, "h": camera.height, "fl_x": camera.fx, "fl_y": camera.fy}
        frame |= {"cx": camera.cx, "cy": camera.cy, "transform_matrix": pose.tolist()}
        if camera.lens is not None:
            frame[OWN_LENS] = lens_to_json(camera.lens)
        frames.append(frame | view.properties)
    _write_json(folder / "transforms.json", {"camera_model": "PINHOLE", "frames": frames})
    with (folder / FACES).open("wb") as file:
        np.savez(file, **mesh.polygons._asdict())
    _write_json(folder / OBJECTS, {"objects": entries})


def _write_json(path: Path, value) -> None:
    path.write_text(json.dumps(value, indent=1, ensure_ascii=False), encoding="utf-8")


def link_or_copy(source: Path, target: Path) -> None:
    """Make `target` a hard link to the picture `source` (symbolic links out of a capture are refused), or a copy."""
    try:
        os.link(source.resolve(), target)
    except OSError:
        shutil.copy2(source, target)


def sources(folder: Path | str) -> tuple[Source, ...]:
    """The objects of a capture that was made of a scene, else none; raises `BadInputError` where it is damaged."""
    path = Path(folder) / OBJECTS
    if not path.is_file():
        return ()
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))["objects"]
        return tuple(Source(**{"whole": entry["name"]} | entry) for entry in entries)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"'{path}' is damaged; capture the scene again.") from error


def check_own(folder: Path | str) -> None:
    """Raise `MissingStageError` unless a capture was made of a scene."""
    if not sources(folder):
        raise MissingStageError(f"Capture '{folder}' was not made of a scene; capture the selected objects first.")


def polygons_of(folder: Path | str, mesh: Mesh) -> Polygons | None:
    """The faces that a capture's triangles were cut from; None where the capture has none, or those of another mesh."""
    try:
        with np.load(Path(folder) / FACES) as stored:
            polygons = Polygons(*(stored[name] for name in Polygons._fields))
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None
    vertex, corner = polygons.vertex, polygons.corner
    matches = corner.max(initial=-1) < len(vertex) and np.array_equal(vertex[corner], mesh.triangles)
    return polygons if matches else None
