"""What of an object has a material of its own: the faces of a material slot, or of a face set painted in Sculpt Mode.

What the artist has marked is not guessed at: each segment becomes an instance of the capture, all but the largest as
parts of that one.
"""

from dataclasses import dataclass
from typing import NamedTuple

import bpy
import numpy as np

from ..custom_properties import BEFORE
from ..data.arrays import faces_of, read

FACE_SETS = ".sculpt_face_set"
"""Attribute of a mesh's faces (int): number of the face set, as Sculpt Mode paints it."""


class Piece(NamedTuple):
    """The faces of one evaluated mesh, in the world.

    Attributes
    ----------
    vertices : (v, 3) float64
    starts : (f + 1,) int32
        First corner of each face, and the end.
    corners : (c,) int32
        Vertex of each corner.
    loops : (t, 3) int32
        Corners of each triangle.
    face_of_triangle : (t,) int32
    slot, face_set : (f,) int32
        Of each face; face sets are all 0 where none are painted.
    materials : tuple of bpy.types.Material or None
        Of each slot; at least one.
    """

    vertices: np.ndarray
    starts: np.ndarray
    corners: np.ndarray
    loops: np.ndarray
    face_of_triangle: np.ndarray
    slot: np.ndarray
    face_set: np.ndarray
    materials: tuple[bpy.types.Material | None, ...]


@dataclass(frozen=True)
class Segment:
    """One instance of the capture.

    Attributes
    ----------
    name : str
        As displayed to the artist.
    class_name : str
        Shared by the same segments of objects with the same mesh, as they are of one kind.
    slot, face_set : int or None
        The object's material slot, or the face set, that it is made of; None where it is not told by that.
    part_of : int or None
        `object_id` of the main segment of its object; None for that one.
    """

    object_id: int
    name: str
    class_name: str
    slot: int | None = None
    face_set: int | None = None
    part_of: int | None = None


def read_piece(evaluated: bpy.types.Object, vertices: np.ndarray, loops: np.ndarray) -> Piece:
    """The faces of an evaluated object, with its world vertices (v, 3) and its triangles' corners (t, 3)."""
    data = evaluated.data
    of_slots = [slot.material for slot in evaluated.material_slots]
    materials = (*of_slots, *list(data.materials)[len(of_slots) :]) or (None,)
    # Blender shows an index without a slot as the last one.
    slot = read(data.polygons, "material_index", kind=np.int32).clip(0, len(materials) - 1)
    layer = data.attributes.get(FACE_SETS)
    painted = layer is not None and layer.domain == "FACE" and layer.data_type == "INT"
    face_set = read(layer.data, "value", kind=np.int32) if painted else np.zeros(len(data.polygons), np.int32)
    face_of_triangle = read(data.loop_triangles, "polygon_index", kind=np.int32)
    originals = tuple(material and material.original for material in materials)
    return Piece(vertices, *faces_of(data), loops, face_of_triangle, slot, face_set, originals)


def segments_of(
    pieces: list[Piece], obj: bpy.types.Object, own: bool, name: str, class_name: str, first_id: int
) -> tuple[list[Segment], list[np.ndarray]]:
    """Divide an object by its used slots; by its painted face sets, where it uses one slot only.

    Parameters
    ----------
    pieces, obj, own
        Its faces and the rest of a `mesh.SceneObject`.
    name, class_name : str
        Of the whole object.
    first_id : int
        `object_id` of the main segment; the others' follow.

    Returns
    -------
    list of Segment
        The main one, of the largest area, first; the others by slot or face set.
    list of (f,) int
        Index in that list of each face, piece by piece.
    """
    kind, (labels, keys) = "slot", _by_slot(pieces, obj, own)
    order = _largest_first(pieces, keys)
    if len(order) < 2:
        kind, keys = "face_set", [piece.face_set for piece in pieces]
        labels = {key: f"face set {key}" for key in np.unique(np.concatenate(keys)).tolist()}
        order = _largest_first(pieces, keys)
    if len(order) < 2:
        return [Segment(first_id, name, class_name)], [np.zeros(len(piece.slot), np.int32) for piece in pieces]
    segments = []
    for index, key in enumerate(order):
        names, part_of = (f"{whole}: {labels[key]}" for whole in (name, class_name)), first_id if index else None
        segments.append(Segment(first_id + index, *names, part_of=part_of, **{kind: key}))
    position = {key: index for index, key in enumerate(order)}
    return segments, [np.int32([position.get(value, 0) for value in key.tolist()]) for key in keys]


def _by_slot(pieces: list[Piece], obj: bpy.types.Object, own: bool) -> tuple[dict[int, str], list[np.ndarray]]:
    """Label of each used slot, and each face's slot, piece by piece."""
    if len(pieces) > 1:  # which may have different slots: what counts is the material
        materials = list(dict.fromkeys(material for piece in pieces for material in piece.materials))
        keys = [np.int32([materials.index(m) for m in piece.materials])[piece.slot] for piece in pieces]
    else:
        materials, keys = list(pieces[0].materials), [pieces[0].slot]
    backup = obj.get(BEFORE, {}) if own else {}
    if "faces" in backup:  # it wears recovered materials by its face sets, which are there still
        return {}, [np.zeros_like(keys[0])]
    if own:  # slots that a modifier adds are not the object's; recovered materials have the names of parts
        before = [entry.get("material") for entry in backup.get("slots", ())]
        materials = (before or materials)[: max(len(obj.material_slots), 1)]
        keys = [keys[0].clip(0, len(materials) - 1)]
    used = np.unique(np.concatenate(keys)).tolist()
    return {key: materials[key].name if materials[key] else f"slot {key + 1}" for key in used}, keys


def _largest_first(pieces: list[Piece], keys: list[np.ndarray]) -> list[int]:
    """Those of the keys whose faces have an area, the largest first and the others by number."""
    areas = []
    for piece in pieces:
        a, b, c = (piece.vertices[piece.corners[piece.loops[:, k]]] for k in range(3))
        areas.append(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    key_of_triangle = np.concatenate([key[piece.face_of_triangle] for piece, key in zip(pieces, keys)])
    values, index = np.unique(key_of_triangle, return_inverse=True)
    sums = np.bincount(index, np.concatenate(areas))
    order = [sums.argmax(), *range(len(values))]  # the largest comes twice, and counts first
    return list(dict.fromkeys(int(values[k]) for k in order if sums[k] > 0))
