"""The parts of a building, each recovered for itself, put together as one scene.

Each part's scene.blend holds what belongs to other parts as well, as it sends light into this one; that is taken out.
"""

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from ...core.atomic import write_bytes
from ...core.errors import BadInputError
from ...core.io.exr import read_exr
from ...core.io.files import json_if_sound
from ...core.io.folder import MATERIALS, REPORT, SCENE
from ...core.io.part import PART
from ...core.results.archive import read_archive
from ...core.results.result_folders import captures
from ...core.results.room_file import DAMAGE, objects_of
from ...core.results.store import STAGES
from ...version import VERSION
from ..custom_properties import IMAGE, OBJECT_ID, OWN_SCENE, RESULT
from ..data.arrays import faces_of, read, vertices_of
from ..data.cameras import FRAME_INDEX, NO_FRAME, frame_cameras, make_track, use_camera
from ..data.images import mark_appended, relative_to
from ..data.instances import in_slot
from ..data.mesh_objects import FAR
from ..refused import check_backslash
from .as_made import NAME, PLACE, SHAPE, stamp
from .parts import CAMERAS, EXPOSURE, LAMPS, ROOM, hide_cameras, load_scene, new_room, part_of, rooms, scene_name
from .write import ENVIRONMENT, prepare, save_whole, start_empty

_OBSERVED = "lit_diffuse.npz"
"""The stored stage that knows in which directions frames saw the outside."""


class _Part(NamedTuple):
    """A part's result: its folder as it was named, the absolute one, and the folder of its capture."""

    name: Path
    folder: Path
    capture: Path


def join(results: Sequence[Path], out: Path) -> tuple[str, ...]:
    """Put the parts of a building together: `out`/scene.blend and materials.json, from an empty file.

    What is open in this process is lost. Images stay in the parts' result folders, and are referred to by relative
    paths. Of what an artist added to a part's scene.blend, such as lights and groups of nodes, nothing is taken.

    Parameters
    ----------
    results : sequence of Path
        The parts' result folders. Where several have the same, as a camera, the first counts.
    out : Path
        Made where absent.

    Returns
    -------
    tuple of str
        Warnings, one sentence each.

    Raises
    ------
    BadInputError
        There is no result, one is unfinished, damaged, of another version or there twice, or `out` holds one.
    StorageError
        `out` can't be written.
    """
    parts, out = _checked(results, out), Path(out).absolute()
    outside = [_outside(part.folder) for part in parts]
    brightest = outside.index(max(outside))
    whole = _whole(parts[0].capture)
    start_empty()
    scene = bpy.context.scene
    top = new_room(whole)
    scene.collection.children.link(top)
    frames: set[str] = set()
    entries: list[dict[str, Any]] = []
    exposures = []
    for number, part in enumerate(parts):
        # Not appended: Blender goes through all data of the file for each datablock that it makes local.
        shell, copies = load_scene(part.folder / SCENE, link=True), _Copies(part.folder, out)
        entries += _take(shell, top, part.folder, out, frames, copies)
        exposures.append(shell.view_settings.exposure)
        if number == brightest:
            scene.world = copies[shell.world]
        if number == 0:
            scene.camera = copies[shell.camera]
        bpy.data.libraries.remove(shell.library)
    prepare(scene)
    scene.view_settings.exposure = scene[EXPOSURE] = median(exposures)
    _finish(scene, top)
    scene.name, scene[OWN_SCENE] = scene_name(whole), True
    save_whole(out / SCENE, scene, [], fresh=True)
    materials = {"capture": whole.name, "objects": entries}
    write_bytes(out / MATERIALS, json.dumps(materials, indent=1, ensure_ascii=False).encode() + b"\n")
    return _on_the_world(parts[brightest].name, *outside[brightest]) if len(parts) > 1 else ()


def _checked(results: Sequence[Path], out: Path) -> list[_Part]:
    """The parts' results; raises `BadInputError`."""
    if not results:
        raise BadInputError("No result is named; give the result folders of a building's parts.")
    parts: list[_Part] = []
    for name in map(Path, results):
        for file in (SCENE, MATERIALS, REPORT):
            if not (name / file).is_file():
                raise BadInputError(f"'{name}' holds no '{file}'; recover that part to the end first.")
        if not objects_of(name):
            raise BadInputError(f"'{name / MATERIALS}' is damaged; recover that part again from its last stage.")
        versions = json_if_sound(name / REPORT).get("versions")
        version = versions.get("scan_relight") if isinstance(versions, dict) else None
        if version != VERSION:
            raise BadInputError(
                f"The result in '{name}' is of version {version or 'unknown'} of Scan Relight, and this is {VERSION}; "
                "recover that part again."
            )
        part = _Part(name, name.absolute(), next(iter(captures(name)), name.absolute()))
        for other in parts:
            if part.folder.resolve() == other.folder.resolve() or part.capture == other.capture:
                raise BadInputError(f"'{other.name}' and '{name}' are results of the same part; leave one of them out.")
        parts.append(part)
    check_backslash(out, "choose one without")
    if (out / REPORT).is_file():
        raise BadInputError(f"'{out}' holds a result, whose {SCENE} would be lost; choose another folder.")
    return parts


def _whole(capture: Path) -> Path:
    """The capture that one is a part of; itself where it tells of none."""
    way = json_if_sound(capture / PART).get("capture")
    return Path(os.path.normpath(capture / way)) if isinstance(way, str) else capture


def _outside(folder: Path) -> tuple[float, float]:
    """How much a result knows of the outside: in which shares of all directions frames saw it, and it has light.

    The first is 0 where the stage that knows it was cleared away.
    """
    seen = lit = 0.0
    try:
        path = folder / STAGES / _OBSERVED
        stored = read_archive(path, ())[0]["meta"]["value"]["tuple"][0]["fields"]["environment"]
        name = stored["fields"]["observations"]["array"]
        seen = _share(read_archive(path, (name,))[1][name] > 0)
    except DAMAGE:
        pass
    try:
        lit = _share(read_exr(folder / ENVIRONMENT).rgb.any(-1))
    except BadInputError:
        pass
    return seen, lit


def _share(chosen: np.ndarray) -> float:
    """The solid angle of chosen directions ((h, 2h) bool) over that of all."""
    weight = np.cos((np.arange(len(chosen)) + 0.5) / len(chosen) * math.pi - math.pi / 2)
    return float(chosen.mean(1) @ weight / weight.sum())


def _on_the_world(name: Path, seen: float, lit: float) -> tuple[str, ...]:
    """Which part's world was taken; nothing where none has light."""
    if not seen and not lit:
        return ()
    why = f"whose frames saw most of it ({seen:.0%} of all directions)" if seen else "which has most of it"
    return (f"A scene has one light from outside: that of '{name}' was taken, {why}; other parts' is left out.",)


class _Copies(dict):
    """Local copies of the linked datablocks of a part, by these; each is made when it is first asked for."""

    def __init__(self, folder: Path, out: Path):
        super().__init__()
        self._folder, self._out = folder, out

    def __missing__(self, linked: bpy.types.ID) -> bpy.types.ID:
        copy = self[linked] = linked.copy()
        if isinstance(copy, bpy.types.Object):
            copy.data = self[linked.data]
            copy[RESULT] = str(self._folder)  # which may have been moved
        elif isinstance(copy, bpy.types.Mesh):
            for slot, material in enumerate(linked.materials):
                copy.materials[slot] = self[material]
        elif isinstance(copy, bpy.types.Image):
            mark_appended([copy], self._folder)
            copy.filepath = copy[IMAGE]
            relative_to(copy, self._out)
        elif isinstance(copy, (bpy.types.Material, bpy.types.World)):
            for node in copy.node_tree.nodes:
                if getattr(node, "image", None) is not None:
                    node.image = self[node.image]
        return copy


def _take(
    shell: bpy.types.Scene, top: bpy.types.Collection, folder: Path, out: Path, frames: set[str], copies: _Copies
) -> list[dict[str, Any]]:
    """Copy what a part's linked scene has of its own to the building; returns its entries of materials.json.

    `frames` are those that have a camera already; the part's are added.
    """
    room = next(iter(rooms(shell)), None)
    if room is None:
        raise BadInputError(f"'{folder / SCENE}' holds no room; run the recovery again from its last stage.")
    far = _far_faces([obj for obj in room.all_objects if obj.type == "MESH"])
    kept: set[int] = set()
    for name in (ROOM, LAMPS, CAMERAS):
        for obj in part_of(room, name).objects:
            if obj.type == "CAMERA":
                frame = obj.get("frame_path", obj.get(NAME, obj.name))
                if obj.get(FRAME_INDEX) == NO_FRAME or frame in frames:
                    continue
                frames.add(frame)
                part_of(top, name).objects.link(copies[obj])
            elif obj in far and not far[obj].all():
                part_of(top, name).objects.link(copies[obj])
                if OBJECT_ID in obj:
                    slots = np.unique(read(obj.data.polygons, "material_index", kind=np.int32)[~far[obj]])
                    kept |= {in_slot(obj, int(slot)) for slot in slots}
                if far[obj].any():
                    _remove_faces(copies[obj], far[obj])
    entries = json_if_sound(folder / MATERIALS).get("objects", ())
    try:
        result = Path(os.path.relpath(folder, out)).as_posix()
    except ValueError:  # another drive
        result = str(folder)
    return [entry | {"result": result} for entry in entries if entry["object_id"] in kept]


def _far_faces(meshes: Sequence[bpy.types.Object]) -> dict[bpy.types.Object, np.ndarray]:
    """Which faces of a part's meshes belong to other parts, (f,) bool each.

    An opening may have been found by several parts: each has those of its faces that are nearer to what is its own.
    """
    far = {obj: np.zeros(len(obj.data.polygons), bool) for obj in meshes}
    for obj, faces in far.items():
        if FAR in obj.data.attributes:
            obj.data.attributes[FAR].data.foreach_get("value", faces)
    openings = [obj for obj in meshes if OBJECT_ID not in obj]
    if openings and any(faces.any() for faces in far.values()):
        scanned = {obj: faces for obj, faces in far.items() if OBJECT_ID in obj}
        own, others = (_tree({obj: faces == side for obj, faces in scanned.items()}) for side in (False, True))
        for obj in openings:
            centres = _corners(obj).mean(1)
            far[obj] = np.array([_distance(others, centre) < _distance(own, centre) for centre in centres])
    return far


def _corners(obj: bpy.types.Object) -> np.ndarray:
    """Corners of a mesh's triangles in the world, (t, 3, 3) float64."""
    # Its basis: the scene was never evaluated.
    return vertices_of(obj.data, obj.matrix_basis)[faces_of(obj.data)[1].reshape(-1, 3)]


def _tree(chosen: dict[bpy.types.Object, np.ndarray]) -> BVHTree:
    """Chosen triangles ((t,) bool) of several objects, to look for the nearest; those without area say nothing."""
    corners = [_corners(obj)[faces & (read(obj.data.polygons, "area") > 0)] for obj, faces in chosen.items()]
    points = np.concatenate(corners).reshape(-1, 3)
    return BVHTree.FromPolygons(points.tolist(), np.arange(len(points)).reshape(-1, 3).tolist(), all_triangles=True)


def _distance(tree: BVHTree, point: np.ndarray) -> float:
    """Metres from a point to the nearest triangle; inf where there is none."""
    distance = tree.find_nearest(Vector(point))[3]
    return math.inf if distance is None else distance


def _remove_faces(obj: bpy.types.Object, faces: np.ndarray) -> None:
    """Take faces ((f,) bool) out of an object's mesh, with what only they use; it counts as made so."""
    import bmesh  # pip's bpy brings it, so it has to be imported first

    data = obj.data
    cut = bmesh.new()
    cut.from_mesh(data)
    cut.faces.ensure_lookup_table()
    bmesh.ops.delete(cut, geom=[cut.faces[i] for i in np.flatnonzero(faces)], context="FACES")
    cut.to_mesh(data)
    cut.free()
    if FAR in data.attributes:
        data.attributes.remove(data.attributes[FAR])
    data.pop(SHAPE, None)
    stamp(obj)


def _finish(scene: bpy.types.Scene, top: bpy.types.Collection) -> None:
    """Show the joined room through its camera, with a track along all frames' cameras, as `write_scene` does."""
    cameras = frame_cameras(scene)
    track = make_track(cameras, part_of(top, CAMERAS))
    if track is not None:
        for name in (NAME, PLACE):  # the first camera's, of which it is a copy
            track.pop(name, None)
        stamp(track)
    use_camera(scene, scene.camera)
    scene.frame_start, scene.frame_end = 1, max(len(cameras), 1)
    hide_cameras(scene, top)
