"""Updates a room that is in the file from a new result; the artist's changes stay."""

import json
from collections.abc import Generator, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..corrections import corrections
from ..custom_properties import CAPTURE, OBJECT_ID, RESULT, RUN
from ..data.arrays import faces_of, layer_of, read, set_layer, vertices_of
from ..data.cameras import FRAME_INDEX, NO_FRAME
from ..data.instances import in_slot, materials_of, slots_of
from ..data.mesh_objects import ATLAS_UV
from ..light import lamps as relight_lamps
from ..own_scene.mesh import same_topology
from ..refused import sentences
from ..scene.as_made import NAME, PLACE, SHAPE, is_corrected, is_edited, is_ours, is_renamed, made_at
from ..scene.parts import LAMPS, PART, ROOM, part_of

KNOWN = "scan_relight_known"
"""Of a room's collection: keys of all objects that were brought in, as JSON; one missing was deleted by the artist."""


@dataclass
class Pair:
    """An object of the file and the new one that it takes data from.

    Attributes
    ----------
    corrected : frozenset of int
        The instances whose material stays as the artist has it.
    made : dict of int to bpy.types.Material
        The new one's materials by instance, in the order of its slots.
    """

    old: bpy.types.Object
    new: bpy.types.Object
    edited: bool = False
    same_shape: bool = False
    corrected: frozenset[int] = frozenset()
    made: dict[int, bpy.types.Material] = field(default_factory=dict)


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


def key_of(obj: bpy.types.Object) -> str:
    """Key that identifies an object of a room across runs."""
    if OBJECT_ID in obj:
        return f"object {obj[OBJECT_ID]}"
    if obj.get(FRAME_INDEX) == NO_FRAME:
        return "track"
    return f"camera {Path(obj.get('frame_path', '')).name or obj.get(NAME, obj.name)}"


def objects_of(top: bpy.types.Collection) -> list[bpy.types.Object]:
    """A room's objects, wherever the artist has put them, and their duplicates."""
    root = Path(top[CAPTURE]).resolve()
    captures = {obj[CAPTURE] for obj in bpy.data.objects if CAPTURE in obj}
    same_capture = {name for name in captures if Path(name).resolve() == root}
    collected = {obj for obj in top.all_objects if OBJECT_ID in obj or "pixel_aspect" in obj}
    local = (obj for obj in bpy.data.objects if not obj.library and obj.users_collection)
    return [obj for obj in local if (obj[CAPTURE] in same_capture if CAPTURE in obj else obj in collected)]


def plan(top: bpy.types.Collection, fresh: bpy.types.Collection) -> Generator[float, None, Steps]:
    """Compare the room in the file with a new one; changes nothing, yields the share done (of a whole, 0.6 to 0.95)."""
    steps = Steps()
    new = {key_of(obj): obj for obj in fresh.all_objects}
    old: dict[str, list[bpy.types.Object]] = {}
    new_objects = set(new.values())
    for obj in objects_of(top):
        if obj not in new_objects:
            old.setdefault(key_of(obj), []).append(obj)
    known = set(json.loads(top.get(KNOWN, "[]")))
    for done, (key, obj) in enumerate(new.items()):
        if obj.type == "MESH":
            yield 0.6 + 0.3 * done / len(new)
        for existing in old.get(key, ()):
            steps.pairs.append(_compare(existing, obj))
        if key not in old and key in known:
            if OBJECT_ID in obj:
                steps.deleted.append(obj[NAME])
        elif key not in old:
            steps.added.append(obj)
    for obj in (existing for key, objects in old.items() if key not in new for existing in objects):
        yield 0.9
        corrected = any(_corrected(slot.material) for slot in obj.material_slots)
        if obj.children or obj.type == "MESH" and (corrected or is_edited(obj)):
            steps.kept_removed.append(obj.name)
        else:
            steps.removed.append(obj)
    return steps


def _compare(old: bpy.types.Object, new: bpy.types.Object) -> Pair:
    if old.type != "MESH" or new.type != "MESH":
        return Pair(old, new)
    made = {in_slot(new, index): slot.material for index, slot in enumerate(new.material_slots)}
    parts = list(slots_of(old))
    same = old.data.get(SHAPE) == new.data[SHAPE] and (not old.material_slots or parts == list(made))
    # Vertex groups are the object's, their weights the mesh's.
    edited = is_edited(old) or bool(old.vertex_groups) and not same
    corrected = frozenset(object_id for object_id in parts if _is_corrected(materials_of(old, object_id)))
    return Pair(old, new, edited, same and not edited, corrected, made)


def _is_corrected(materials: list[bpy.types.Material]) -> bool:
    """Whether an instance with these materials wears the artist's own, or a recovered one that was changed."""
    return bool(materials) and (not any(map(is_ours, materials)) or any(map(_corrected, materials)))


def _corrected(material: bpy.types.Material | None) -> bool:
    return is_ours(material) and is_corrected(material)


def commit(steps: Steps, top: bpy.types.Collection, fresh: bpy.types.Collection, shell: bpy.types.Scene) -> list[str]:
    """Carry out the plan; returns sentences on what stays as the artist has it."""
    lamps = set(part_of(fresh, LAMPS).objects)
    for name in (RESULT, RUN, CAPTURE):
        top[name] = fresh[name]
    before = corrections.instances_in([*(pair.old for pair in steps.pairs), *steps.removed])
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
    for obj in steps.added:
        collection = next((collection for collection in obj.users_collection if PART in collection), None)
        (part_of(top, collection[PART]) if collection is not None else top).objects.link(obj)
    now = [*(pair.old for pair in steps.pairs), *steps.added]
    corrections.carry(before, corrections.instances_in(now))
    owned = [data for obj in steps.removed for data in (obj.data, *(slot.material for slot in obj.material_slots))]
    steps.replaced.extend(data.session_uid for data in owned if data is not None)
    if steps.removed:
        bpy.data.batch_remove(steps.removed)
    note_known(top, fresh.all_objects)
    return [*_messages(steps), *(sentence for obj in now for sentence in corrections.reapply(obj))]


def note_known(top: bpy.types.Collection, objects: Iterable[bpy.types.Object]) -> None:
    """Remember which objects were brought into a room."""
    top[KNOWN] = json.dumps(sorted({*json.loads(top.get(KNOWN, "[]")), *map(key_of, objects)}))


def _messages(steps: Steps) -> tuple[str, ...]:
    edited = [pair.old.name for pair in steps.pairs if pair.edited]
    corrected = [pair.old.name for pair in steps.pairs if pair.corrected]
    return sentences(
        (edited, "the mesh was edited and is left as it is; the material is new"),
        (corrected, "the material was corrected and stays"),
        (steps.deleted, "was deleted and stays so; delete the room's scene and run again to have it back"),
        (steps.kept_removed, "is no longer part of the result, but was edited and stays"),
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
    """Give an object the new mesh and materials, except where the artist changed them."""
    old, new, made = pair.old, pair.new, pair.made
    worn = {i: materials_of(old, i) for i in slots_of(old)}
    data = old.data
    if pair.edited:
        atlas_onto(data, made_at(old) if PLACE in old else old.matrix_basis, new.data, made_at(new))
    elif pair.same_shape:
        for layer in new.data.uv_layers:
            set_layer(data, layer.name, layer_of(new.data, layer.name)).active_render = layer.active_render
    else:
        if data not in meshes:
            # Duplicates with different meshes keep different meshes.
            meshes[data] = new.data.copy() if new.data in used else new.data
            used.add(meshes[data])
        fresh = meshes[data]
        fresh.materials.clear()
        for material in [worn[i][0] if i in pair.corrected else made[i] for i in made] or data.materials:
            fresh.materials.append(material)
        if any(polygon.use_smooth for polygon in data.polygons[:1]):  # as made it is flat
            fresh.shade_smooth()
        steps.replaced.append(data.session_uid)
        steps.names.append((fresh, data.name))
        old.data = fresh
    if made:
        _dress_slots(pair, worn, steps)


def _dress_slots(pair: Pair, worn: dict[int, list[bpy.types.Material]], steps: Steps) -> None:
    """Give the slots of an object that wore the materials `worn`, by instance, the new ones."""
    old, made = pair.old, pair.made
    if not old.material_slots:
        for material in made.values():
            old.data.materials.append(material)
    for object_id, indices in slots_of(old).items():
        # What is no part any more belongs to the whole again.
        material = made.get(object_id, made[old[OBJECT_ID]])
        before = [other for other in worn.get(object_id, ()) if is_ours(other)][:1]
        if object_id in pair.corrected or not indices:
            continue
        replaced = [index for index in indices if old.material_slots[index].material in (*before, material)]
        for index in replaced or indices[:1]:
            old.material_slots[index].material = material
    for object_id, materials in worn.items():
        before, material = next(filter(is_ours, materials), None), made.get(object_id)
        if object_id in pair.corrected or before is None or before == material:
            continue
        steps.replaced.append(before.session_uid)
        if material is not None:
            if relight_lamps.is_lamp(before) and relight_lamps.is_lamp(material):
                relight_lamps.carry(before, material)
            steps.names.append((material, before.name))


def _sort(obj: bpy.types.Object, top: bpy.types.Collection, lamp: bool) -> None:
    """Move an object that became a lamp, or ceased to be one, to the other collection, unless the artist moved it."""
    inside = top.children_recursive
    parts = [collection for collection in obj.users_collection if collection.get(PART) and collection in inside]
    target = part_of(top, LAMPS if lamp else ROOM)
    if len(parts) == 1 and parts[0] != target and parts[0][PART] in (LAMPS, ROOM):
        parts[0].objects.unlink(obj)
        target.objects.link(obj)


def _track(old: bpy.types.Object, new: bpy.types.Object, steps: Steps) -> None:
    animated = old.animation_data_create()
    if animated.action is not None:
        steps.replaced.append(animated.action.session_uid)
        steps.names.append((new.animation_data.action, animated.action.name))
    animated.action = new.animation_data.action
    animated.action_slot = new.animation_data.action_slot


def atlas_onto(data: bpy.types.Mesh, matrix: Matrix, source: bpy.types.Mesh, source_matrix: Matrix) -> None:
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

    corners = _corners(source, source_matrix)
    triangles, uv_triangles = corners.reshape(-1, 3, 3), uv.reshape(-1, 3, 2)
    total = read(data.polygons, "loop_total", kind=np.int32)
    face = np.repeat(np.arange(len(total)), total)
    points = _corners(data, matrix)
    centres = np.stack([np.bincount(face, points[:, axis], len(total)) for axis in range(3)], 1) / total[:, None]
    nearest = cKDTree(triangles.mean(1)).query(centres)[1][face]
    first = triangles[nearest, 0]
    edges = triangles[nearest, 1:] - first[:, None]
    # Least squares on the triangle's plane; a sliver's pseudo-inverse stays finite.
    weights = np.einsum("ijk,ik->ij", np.linalg.pinv(edges.transpose(0, 2, 1)), points - first)
    uv_edges = uv_triangles[nearest, 1:] - uv_triangles[nearest, :1]
    new_uv = (uv_triangles[nearest, 0] + np.einsum("ij,ijk->ik", weights, uv_edges)).clip(0, 1)
    set_layer(data, ATLAS_UV, new_uv).active_render = True


def _corners(data: bpy.types.Mesh, matrix: Matrix) -> np.ndarray:
    """World position of each corner of a mesh, (c, 3)."""
    return vertices_of(data, matrix)[faces_of(data)[1]]
