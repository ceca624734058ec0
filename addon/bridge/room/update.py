"""A room that is in the file already becomes that of a new result; what the artist did to it stays."""

import json
from collections.abc import Generator, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..corrections import corrections
from ..data.arrays import faces_of, layer_of, read, set_layer, vertices_of
from ..data.cameras import FRAME_INDEX, NO_FRAME
from ..data.mesh_objects import ATLAS_UV
from ..light import lamps as relight_lamps
from ..marks import CAPTURE, OBJECT_ID, RESULT, RUN
from ..own_scene.mesh import same_topology
from ..refused import sentences
from ..scene.as_made import NAME, PLACE, SHAPE, is_corrected, is_edited, is_ours, is_renamed, made_at
from ..scene.parts import LAMPS, PART, ROOM, part_of

KNOWN = "scan_relight_known"
"""Of a room's collection: all things that were brought, as JSON; one that is gone was deleted by the artist."""


@dataclass
class Pair:
    """An object of the file and the one that takes its place or lends it its data."""

    old: bpy.types.Object
    new: bpy.types.Object
    edited: bool = False
    same_shape: bool = False
    corrected: bool = False


@dataclass
class Steps:
    """What `commit` does, and what it leaves to do: `session_uid` of the data that was replaced, names to be given once
    that is gone."""

    pairs: list[Pair] = field(default_factory=list)
    added: list[bpy.types.Object] = field(default_factory=list)
    removed: list[bpy.types.Object] = field(default_factory=list)
    replaced: list[int] = field(default_factory=list)
    names: list[tuple[bpy.types.ID, str]] = field(default_factory=list)
    kept_removed: list[str] = field(default_factory=list)
    deleted: list[str] = field(default_factory=list)


def key_of(thing: bpy.types.Object) -> str:
    """What an object of a room is known by."""
    if OBJECT_ID in thing:
        return f"object {thing[OBJECT_ID]}"
    if thing.get(FRAME_INDEX) == NO_FRAME:
        return "track"
    return f"camera {Path(thing.get('frame_path', '')).name or thing.get(NAME, thing.name)}"


def things_of(top: bpy.types.Collection) -> list[bpy.types.Object]:
    """A room's objects, wherever the artist has put them, and their duplicates."""
    root = Path(top[CAPTURE]).resolve()
    same = {
        name: Path(name).resolve() == root
        for name in {thing[CAPTURE] for thing in bpy.data.objects if CAPTURE in thing}
    }
    within = {thing for thing in top.all_objects if OBJECT_ID in thing or "pixel_aspect" in thing}
    return [
        thing
        for thing in bpy.data.objects
        if not thing.library
        and thing.users_collection
        and (same[thing[CAPTURE]] if CAPTURE in thing else thing in within)
    ]


def plan(top: bpy.types.Collection, fresh: bpy.types.Collection) -> Generator[float, None, Steps]:
    """Compare the room in the file with a new one; changes nothing, yields the share done (of a whole, 0.6 to 0.95)."""
    steps = Steps()
    new = {key_of(thing): thing for thing in fresh.all_objects}
    old: dict[str, list[bpy.types.Object]] = {}
    came = set(new.values())
    for thing in things_of(top):
        if thing not in came:
            old.setdefault(key_of(thing), []).append(thing)
    known = set(json.loads(top.get(KNOWN, "[]")))
    for done, (key, thing) in enumerate(new.items()):
        if thing.type == "MESH":
            yield 0.6 + 0.3 * done / len(new)
        for one in old.get(key, ()):
            steps.pairs.append(_compare(one, thing))
        if key not in old and key in known:
            if OBJECT_ID in thing:
                steps.deleted.append(thing[NAME])
        elif key not in old:
            steps.added.append(thing)
    for thing in (one for key, some in old.items() if key not in new for one in some):
        yield 0.9
        hers = thing.type == "MESH" and (is_edited(thing) or any(map(_corrected, thing.material_slots)))
        if hers or thing.children:
            steps.kept_removed.append(thing.name)
        else:
            steps.removed.append(thing)
    return steps


def _compare(old: bpy.types.Object, new: bpy.types.Object) -> Pair:
    if old.type != "MESH" or new.type != "MESH":
        return Pair(old, new)
    same = old.data.get(SHAPE) == new.data[SHAPE]
    # Vertex groups are the object's, their weights the mesh's.
    edited = is_edited(old) or bool(old.vertex_groups) and not same
    slots = old.material_slots
    worn = any(slot.material for slot in slots)
    ours = any(is_ours(slot.material) for slot in slots)
    return Pair(old, new, edited, same and not edited, worn and (not ours or any(map(_corrected, slots))))


def _corrected(slot: bpy.types.MaterialSlot) -> bool:
    return is_ours(slot.material) and is_corrected(slot.material)


def commit(steps: Steps, top: bpy.types.Collection, fresh: bpy.types.Collection, shell: bpy.types.Scene) -> list[str]:
    """Do what was planned; sentences on what stays as the artist has it."""
    lamps = set(part_of(fresh, LAMPS).objects)
    for name in (RESULT, RUN, CAPTURE):
        top[name] = fresh[name]
    meshes: dict[bpy.types.Mesh, bpy.types.Mesh] = {}
    used: set[bpy.types.Mesh] = set()
    for pair in steps.pairs:
        old, new = pair.old, pair.new
        _place(pair)
        if old.type == "MESH":
            _dress(pair, meshes, used, steps)
            _sort(old, top, new in lamps)
        elif new.animation_data is not None:
            _track(old, new, steps)
        if not is_renamed(old) and old.get(NAME) != new[NAME]:
            steps.names.append((old, new[NAME]))
        for name in (RESULT, RUN, CAPTURE):
            old[name] = new[name]
        old[NAME] = new[NAME]
        if shell.camera == new:
            shell.camera = old
    for thing in steps.added:
        part = next((one for one in thing.users_collection if PART in one), None)
        (part_of(top, part[PART]) if part is not None else top).objects.link(thing)
    owned = [one for thing in steps.removed for one in (thing.data, *(slot.material for slot in thing.material_slots))]
    steps.replaced.extend(one.session_uid for one in owned if one is not None)
    if steps.removed:
        bpy.data.batch_remove(steps.removed)
    note_known(top, fresh.all_objects)
    again = [sentence for pair in steps.pairs for sentence in corrections.reapply(pair.old)]
    return _told(steps) + again


def note_known(top: bpy.types.Collection, things: Iterable[bpy.types.Object]) -> None:
    """Keep which things were brought into a room."""
    top[KNOWN] = json.dumps(sorted({*json.loads(top.get(KNOWN, "[]")), *map(key_of, things)}))


def _told(steps: Steps) -> list[str]:
    edited, corrected = (
        [pair.old.name for pair in steps.pairs if getattr(pair, one)] for one in ("edited", "corrected")
    )
    return list(
        sentences(
            (edited, "the mesh was edited and is left as it is; the material is new"),
            (corrected, "the material was corrected and stays"),
            (steps.deleted, "was deleted and stays so; delete the room's scene and run again to have it back"),
            (steps.kept_removed, "is no longer part of the result, but was edited and stays"),
        )
    )


def _place(pair: Pair) -> None:
    """Move an object as far as its original moved; what the artist did to it stays on top."""
    old, new = pair.old, pair.new
    if PLACE not in old or pair.edited or list(old[PLACE]) == list(new[PLACE]):
        return
    # In the object's own space, so that parents cancel out: basis' = basis inverse(made) made'.
    old.matrix_basis = old.matrix_basis @ made_at(old).inverted() @ made_at(new)
    old[PLACE] = list(new[PLACE])


def _dress(pair: Pair, meshes: dict, used: set, steps: Steps) -> None:
    """Give an object the new mesh and material, but for what is the artist's."""
    old, new = pair.old, pair.new
    slot = next((one for one in old.material_slots if is_ours(one.material)), None)
    worn = slot.material if slot is not None else None
    material = new.material_slots[0].material if new.material_slots else None
    data = old.data
    if pair.edited:
        atlas_onto(data, made_at(old) if PLACE in old else old.matrix_basis, new.data, made_at(new))
    elif pair.same_shape:
        for layer in new.data.uv_layers:
            set_layer(data, layer.name, layer_of(new.data, layer.name)).active_render = layer.active_render
    else:
        if data not in meshes:
            # The mesh of another duplicate stays another mesh.
            meshes[data] = new.data.copy() if new.data in used else new.data
            used.add(meshes[data])
        fresh = meshes[data]
        if pair.corrected or material is None:
            fresh.materials.clear()
            for worn_by_it in data.materials:
                fresh.materials.append(worn_by_it)
        elif fresh != new.data or not fresh.materials:
            fresh.materials.clear()
            fresh.materials.append(material)
        if any(polygon.use_smooth for polygon in data.polygons[:1]):  # as made it is flat
            fresh.shade_smooth()
        steps.replaced.append(data.session_uid)
        steps.names.append((fresh, data.name))
        old.data = fresh
    if pair.corrected or material is None:
        return
    if not old.material_slots:
        old.data.materials.append(material)
    else:
        slot = next((one for one in old.material_slots if one.material in (worn, material)), old.material_slots[0])
        slot.material = material
    if worn is not None and worn != material:
        if relight_lamps.is_lamp(worn) and relight_lamps.is_lamp(material):
            relight_lamps.carry(worn, material)
        steps.replaced.append(worn.session_uid)
        steps.names.append((material, worn.name))


def _sort(thing: bpy.types.Object, top: bpy.types.Collection, lamp: bool) -> None:
    """Put an object that became a lamp, or is none any more, into the other part, unless the artist moved it."""
    parts = [one for one in thing.users_collection if one.get(PART) and one in top.children_recursive]
    wanted = part_of(top, LAMPS if lamp else ROOM)
    if len(parts) == 1 and parts[0] != wanted and parts[0].get(PART) in (LAMPS, ROOM):
        parts[0].objects.unlink(thing)
        wanted.objects.link(thing)


def _track(old: bpy.types.Object, new: bpy.types.Object, steps: Steps) -> None:
    animated = old.animation_data_create()
    if animated.action is not None:
        steps.replaced.append(animated.action.session_uid)
        steps.names.append((new.animation_data.action, animated.action.name))
    animated.action = new.animation_data.action
    animated.action_slot = new.animation_data.action_slot


def atlas_onto(data: bpy.types.Mesh, place: Matrix, source: bpy.types.Mesh, source_place: Matrix) -> None:
    """Give an edited mesh the atlas coordinates of `source`, each mesh standing at its place.

    Where only vertices were moved, those of the same corner. Else each face continues the map of the nearest triangle
    of `source`, so that no face is spread over two islands of the atlas.
    """
    if not len(data.polygons) or not len(source.polygons) or ATLAS_UV not in source.uv_layers:
        return
    uv = layer_of(source, ATLAS_UV)
    if same_topology(data, source):
        set_layer(data, ATLAS_UV, uv).active_render = True
        return
    from scipy.spatial import cKDTree  # not earlier: Blender's start should not wait for it

    corners = _corners(source, source_place)
    triangles, maps = corners.reshape(-1, 3, 3), uv.reshape(-1, 3, 2)
    total = read(data.polygons, "loop_total", kind=np.int32)
    face = np.repeat(np.arange(len(total)), total)
    own = _corners(data, place)
    middle = np.stack([np.bincount(face, own[:, axis], len(total)) for axis in range(3)], 1) / total[:, None]
    nearest = cKDTree(triangles.mean(1)).query(middle)[1][face]
    first = triangles[nearest, 0]
    edges = triangles[nearest, 1:] - first[:, None]
    # Least squares on the triangle's plane; a sliver's pseudo-inverse stays finite.
    share = np.einsum("ijk,ik->ij", np.linalg.pinv(edges.transpose(0, 2, 1)), own - first)
    steps = maps[nearest, 1:] - maps[nearest, :1]
    new = (maps[nearest, 0] + np.einsum("ij,ijk->ik", share, steps)).clip(0, 1)
    set_layer(data, ATLAS_UV, new).active_render = True


def _corners(data: bpy.types.Mesh, place: Matrix) -> np.ndarray:
    """Where each corner of a mesh is that stands at a place, (c, 3)."""
    return vertices_of(data, place)[faces_of(data)[1]]
