"""Objects of the open scene as one mesh of triangles, with the face that each triangle was cut from.

Read as the viewport shows it: modifiers and instances evaluated, in world space. An object, and each object that an
instanced collection shows, becomes an instance of the capture for each of its segments (`segments.py`).
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.errors import BadInputError
from ..data.arrays import faces_of, make_mesh, triangles_of, vertices_of
from ..data.unwrap import Polygons
from .segments import Piece, Segment, read_piece, segments_of

OBJECT_TYPES = ("MESH", "CURVE", "SURFACE", "FONT", "EMPTY")
"""Types of objects that may have faces; an empty has those of the collection that it instances."""


@dataclass
class SceneObject:
    """An object of the scene, or one that an instanced collection shows.

    Attributes
    ----------
    name : str
        As displayed to the artist.
    obj : bpy.types.Object
        The artist's object that shows it.
    own : bool
        Its faces are those of the object's mesh, one by one and in their order, so that materials can be put there.
    segments : list of Segment
        Its instances, the main one first.
    segment_of : list of (f,) int
        Index in `segments` of each face, piece by piece.
    """

    name: str
    obj: bpy.types.Object
    own: bool = True
    pieces: list[Piece] = field(default_factory=list)
    segments: list[Segment] = field(default_factory=list)
    segment_of: list[np.ndarray] = field(default_factory=list)

    @property
    def topology(self) -> str:
        """A hash of what its faces connect; stays the same where vertices are only moved."""
        return topology_hash([(piece.starts, piece.corners) for piece in self.pieces])

    def mesh(self) -> bpy.types.Mesh:
        """Its faces as a mesh of their own, in world coordinates, flat."""
        merged = joined([self])
        return make_mesh(self.name, merged.vertices, merged.polygons.vertex, merged.polygons.start[:-1])


@dataclass(frozen=True)
class SceneMesh:
    """All objects as one.

    Attributes
    ----------
    vertices : (v, 3) float64
        World, Blender's units.
    triangles : (t, 3) int32
    object_id : (t,) int32
    polygons : Polygons
        The faces that the triangles were cut from, over the same vertices.
    corner_start : dict of int to int
        First corner in `polygons` of each instance's object; the next ones follow in the order of its mesh's loops.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    object_id: np.ndarray
    polygons: Polygons
    corner_start: dict[int, int]


def gather(depsgraph: bpy.types.Depsgraph, objects: Iterable[bpy.types.Object]) -> list[SceneObject]:
    """Read the evaluated faces of objects.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Up to date.
    objects : iterable of bpy.types.Object
        The artist's; those without faces are left out. Their order is kept: same scene, same numbers.

    Raises
    ------
    BadInputError
        An object has vertices that are not finite.
    """
    ranks = {obj: rank for rank, obj in enumerate(objects) if obj.type in OBJECT_TYPES}
    by_key: dict[tuple, SceneObject] = {}
    for instance in depsgraph.object_instances:
        original = instance.parent.original if instance.is_instance and instance.parent else instance.object.original
        if original not in ranks or instance.object.type != "MESH":
            continue
        instanced = instance.is_instance and original.type == "EMPTY"
        # Instances that a mesh object generates itself (geometry nodes, particles) belong to it.
        key = (ranks[original], *(instance.persistent_id if instanced else ()))
        scene_object = by_key.get(key)
        if scene_object is None:
            name = f"{original.name}/{instance.object.name}" if instanced else original.name
            scene_object = by_key[key] = SceneObject(name, original)
        data = instance.object.data
        is_plain = not instance.is_instance and not scene_object.pieces and original.type == "MESH"
        scene_object.own &= is_plain and same_topology(data, original.data)
        vertices, loops = vertices_of(data, instance.matrix_world), triangles_of(data, "loops")
        if not np.isfinite(vertices).all():
            raise BadInputError(f"Object '{original.name}' has vertices that are not finite; mend its mesh first.")
        if instance.matrix_world.is_negative:  # mirrored: the front is given by the reverse order of corners
            loops = loops[:, [0, 2, 1]]
        scene_object.pieces.append(read_piece(instance.object, vertices, loops))
    scene_objects = [by_key[key] for key in sorted(by_key) if any(len(piece.loops) for piece in by_key[key].pieces)]
    kinds: dict[bpy.types.ID, str] = {}
    first_id = 0
    for scene_object in scene_objects:
        pieces, obj, own, name = scene_object.pieces, scene_object.obj, scene_object.own, scene_object.name
        class_name = kinds.setdefault(obj.data, name) if own else name
        segments = segments_of(pieces, obj, own, name, class_name, first_id)
        scene_object.segments, scene_object.segment_of = segments
        first_id += len(scene_object.segments)
    return scene_objects


def same_topology(first: bpy.types.Mesh, second: bpy.types.Mesh) -> bool:
    """Whether two meshes have the same faces in the same order, wherever their vertices are."""
    same_faces = all(np.array_equal(a, b) for a, b in zip(faces_of(first), faces_of(second)))
    return same_faces and len(first.vertices) == len(second.vertices)


def topology_hash(pieces: Iterable[tuple[np.ndarray, np.ndarray]]) -> str:
    """A hash of what `faces_of` gives, piece by piece."""
    digest = hashlib.sha256()
    for starts, corners in pieces:
        digest.update(np.int64([len(starts), len(corners)]).tobytes() + starts.tobytes() + corners.tobytes())
    return digest.hexdigest()


def joined(scene_objects: Iterable[SceneObject]) -> SceneMesh:
    """One mesh of all objects; triangles keep the order of the objects' faces."""
    columns = vertices, starts, corners, loops, ids = [], [], [], [], []
    first_vertex = first_corner = 0
    corner_start = {}
    for scene_object in scene_objects:
        corner_start |= dict.fromkeys((segment.object_id for segment in scene_object.segments), first_corner)
        object_ids = np.int32([segment.object_id for segment in scene_object.segments])
        for piece, segment_of in zip(scene_object.pieces, scene_object.segment_of):
            offset_arrays = piece.starts[:-1] + first_corner, piece.corners + first_vertex, piece.loops + first_corner
            triangle_ids = object_ids[segment_of[piece.face_of_triangle]]
            for column, values in zip(columns, (piece.vertices, *offset_arrays, triangle_ids)):
                column.append(values)
            first_vertex += len(piece.vertices)
            first_corner += len(piece.corners)
    start, corner, loop, ids = (np.concatenate(arrays).astype(np.int32) for arrays in (starts, corners, loops, ids))
    polygons = Polygons(np.append(start, np.int32(first_corner)), corner, loop)
    return SceneMesh(np.concatenate(vertices), corner[loop], ids, polygons, corner_start)
