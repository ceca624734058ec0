"""The open scene as a capture folder: objects, cameras and the pictures behind them.

The folder is one that every reader of nerfstudio's layout takes. Two more files hold the way back: `scene.json` (which
object each instance is) and `faces.npz` (which corners of its faces each triangle has).
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
from ...core.scene.lenses_told import told_lens
from ...core.scene.model import Mesh
from ..data.unwrap import Polygons
from ..refused import MAX_TOLD, sentences, whole_folder
from . import cameras as scene_cameras
from .mesh import Part, SceneMesh, gather, joined

OBJECTS, FACES = "scene.json", "faces.npz"


@dataclass(frozen=True)
class Source:
    """Which object of the scene an instance of the capture is.

    Attributes
    ----------
    thing : str
        Name of the object that shows it, when it was captured.
    own : bool
        Its faces are those of the object's mesh.
    topology : str
        See `own_scene.mesh.Part.topology`.
    corner_start : int
        First of its corners in `faces.npz`.
    """

    object_id: int
    name: str
    thing: str
    own: bool
    topology: str
    corner_start: int


def capture_scene(
    context: bpy.types.Context,
    folder: Path | str,
    things: Iterable[bpy.types.Object],
    how: str = scene_cameras.AUTO,
    first: int | None = None,
    last: int | None = None,
    step: int = 1,
) -> tuple[str, ...]:
    """Write objects and cameras of the open scene as a capture; the scene stays as it is.

    Parameters
    ----------
    folder : Path or str
        Replaced as a whole where an earlier capture of a scene is there.
    things : iterable of bpy.types.Object
        Their surfaces become the mesh; cameras among them are the only ones that are taken.
    how, first, last, step
        See `own_scene.cameras.views`.

    Returns
    -------
    tuple of str
        Warnings, one sentence each.

    Raises
    ------
    BadInputError
        Nothing to take in, no usable picture, or `folder` holds something else.
    StorageError
        The folder can't be written.
    """
    folder, scene = Path(folder).absolute(), context.scene
    if folder.exists() and not (folder / OBJECTS).is_file() and any(folder.iterdir()):
        raise BadInputError(f"Folder '{folder}' holds something else already; choose another.")
    things = sorted(things, key=lambda thing: thing.name)
    cameras = scene_cameras.cameras_with_pictures(scene, things)
    if not cameras:
        raise BadInputError(
            "No camera has a picture behind it; give each camera its frame as a background image, or "
            "one animated camera a sequence (Camera, Background Images)."
        )
    parts = gather(context.evaluated_depsgraph_get(), things)
    if not parts:
        raise BadInputError("No object with faces is selected; select the room's objects first.")
    mesh = joined(parts)
    # Only the triangles that the reader will keep, so that its triangles are the file's, one by one.
    numbered = RawMesh(mesh.vertices, mesh.triangles, np.arange(len(mesh.triangles)), name="of the scene")
    kept = repair(numbered)[0].object_id
    polygons = mesh.polygons._replace(corner=mesh.polygons.corner[kept])
    mesh = replace(mesh, triangles=mesh.triangles[kept], object_id=mesh.object_id[kept], polygons=polygons)
    problems: list[str] = []
    now = scene.frame_current, scene.frame_subframe
    try:
        views = list(
            scene_cameras.views(scene, context.evaluated_depsgraph_get(), cameras, problems, how, first, last, step)
        )
    finally:
        if (scene.frame_current, scene.frame_subframe) != now:
            scene.frame_set(now[0], subframe=now[1])
    more = len(problems) - MAX_TOLD
    told = " ".join(problems[:MAX_TOLD]) + (f" And {more} more." if more > 0 else "")
    if not views:
        raise BadInputError(f"None of the pictures can be used: {told}")
    metre = scene.unit_settings.scale_length if scene.unit_settings.system != "NONE" else 1.0
    with whole_folder(folder, f"The scene can't be captured into '{folder}'") as part:
        _write(part, mesh, parts, views, metre)
    return (
        (f"{len(problems)} of {len(problems) + len(views)} pictures are left out: {told}",) if problems else ()
    ) + _doubts(parts)


def _doubts(parts: list[Part]) -> tuple[str, ...]:
    """Sentences on objects whose materials can't simply be put back."""
    made = [part.name for part in parts if not part.own]
    linked = [part.name for part in parts if part.own and (part.thing.library or part.thing.override_library)]
    local = "make it local first (Object, Relations, Make Local)"
    return sentences(
        (made, "modifiers or instances make the faces, so the materials can only go onto a copy"),
        (linked, f"linked from another file, so the materials can't go there; {local}"),
    )


def _write(folder: Path, mesh: SceneMesh, parts: list[Part], views: list[scene_cameras.View], metre: float) -> None:
    (folder / "mesh.ply").write_bytes(ply_bytes(mesh.vertices * metre, [(mesh.triangles, mesh.object_id)]))
    names = [{"id": part.object_id, "class_name": part.class_name, "name": part.name} for part in parts]
    _json(folder / "info_semantic.json", {"objects": names})
    (folder / "images").mkdir()
    frames = []
    for view in views:
        place, camera, pose = f"images/{view.name}.exr", view.camera, view.camera.camera_to_world.copy()
        bring(view.path, folder / place)
        pose[:3, 3] *= metre
        frame = {"file_path": place, "w": camera.width, "h": camera.height, "fl_x": camera.fx, "fl_y": camera.fy}
        frame |= {"cx": camera.cx, "cy": camera.cy, "transform_matrix": pose.tolist()}
        if camera.lens is not None:
            frame[OWN_LENS] = told_lens(camera.lens)
        frames.append(frame | view.told)
    _json(folder / "transforms.json", {"camera_model": "PINHOLE", "frames": frames})
    told = [
        Source(one.object_id, one.name, one.thing.name, one.own, one.topology, mesh.corner_start[one.object_id])
        for one in parts
    ]
    with (folder / FACES).open("wb") as file:
        np.savez(file, **mesh.polygons._asdict())
    _json(folder / OBJECTS, {"objects": [asdict(one) for one in told]})


def _json(path: Path, value) -> None:
    path.write_text(json.dumps(value, indent=1, ensure_ascii=False), encoding="utf-8")


def bring(source: Path, target: Path) -> None:
    """Let `target` be the picture `source`: a hard link, as symbolic ones out of a capture are refused, or a copy."""
    try:
        os.link(source.resolve(), target)
    except OSError:
        shutil.copy2(source, target)


def sources(folder: Path | str) -> tuple[Source, ...]:
    """The objects of a capture that was made of a scene, else none; raises `BadInputError`: the list is damaged."""
    path = Path(folder) / OBJECTS
    if not path.is_file():
        return ()
    try:
        return tuple(Source(**one) for one in json.loads(path.read_text(encoding="utf-8"))["objects"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"'{path}' is damaged; capture the scene again.") from error


def check_own(folder: Path | str) -> None:
    """Raise `MissingStageError` unless a capture was made of a scene."""
    if not sources(folder):
        raise MissingStageError(f"Capture '{folder}' was not made of a scene; capture the selected objects first.")


def polygons_of(folder: Path | str, mesh: Mesh) -> Polygons | None:
    """The faces that a capture's triangles were cut from; None where the capture does not tell, or another mesh's."""
    try:
        with np.load(Path(folder) / FACES) as stored:
            found = Polygons(*(stored[name] for name in Polygons._fields))
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None
    same = (
        len(found.corner) == len(mesh.triangles)
        and found.corner.max(initial=-1) < len(found.vertex)
        and np.array_equal(found.vertex[found.corner], mesh.triangles)
    )
    return found if same else None
