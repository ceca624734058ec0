"""Objects of the open scene as one mesh of triangles, with the face that each triangle was cut from.

Read as the viewport shows it: modifiers and instances evaluated, in world space. Each object has its own materials, so
each becomes an instance of the capture; so does each object that an instanced collection shows.
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.errors import BadInputError
from ..data.arrays import faces_of, make_mesh, triangles_of, vertices_of
from ..data.unwrap import Polygons

OBJECT_TYPES = ("MESH", "CURVE", "SURFACE", "FONT", "EMPTY")
"""Types of objects that may have faces; an empty has those of the collection that it instances."""


@dataclass
class Part:
    """One instance of the capture.

    Attributes
    ----------
    name : str
        As displayed to the artist.
    class_name : str
        Shared by objects with the same mesh, as they are of one kind.
    obj : bpy.types.Object
        The artist's object that shows it.
    own : bool
        Its faces are those of the object's mesh, one by one and in their order, so that materials can be put there.
    pieces : list of (vertices, starts, corners, loops)
        World positions (v, 3) float64; first corner of each face (f + 1,), vertex of each corner (c,) and the corners
        of each triangle (t, 3), int32.
    """

    object_id: int
    name: str
    class_name: str
    obj: bpy.types.Object
    own: bool = True
    pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=list)

    @property
    def topology(self) -> str:
        """A hash of what its faces connect; stays the same where vertices are only moved."""
        return topology_hash([piece[1:3] for piece in self.pieces])

    def mesh(self) -> bpy.types.Mesh:
        """Its faces as a mesh of their own, in world coordinates, flat."""
        merged = joined([self])
        return make_mesh(self.name, merged.vertices, merged.polygons.vertex, merged.polygons.start[:-1])


@dataclass(frozen=True)
class SceneMesh:
    """All parts as one.

    Attributes
    ----------
    vertices : (v, 3) float64
        World, Blender's units.
    triangles : (t, 3) int32
    object_id : (t,) int32
    polygons : Polygons
        The faces that the triangles were cut from, over the same vertices.
    corner_start : dict of int to int
        First corner in `polygons` of each object; the next ones follow in the order of its mesh's loops.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    object_id: np.ndarray
    polygons: Polygons
    corner_start: dict[int, int]


def gather(depsgraph: bpy.types.Depsgraph, objects: Iterable[bpy.types.Object]) -> list[Part]:
    """Read the evaluated faces of objects.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Up to date.
    objects : iterable of bpy.types.Object
        The artist's; those without a surface are skipped.

    Returns
    -------
    list of Part
        In the order of `objects`; one without faces is left out. Same scene, same numbers.

    Raises
    ------
    BadInputError
        An object has vertices that are not finite.
    """
    ranks = {obj: rank for rank, obj in enumerate(objects) if obj.type in OBJECT_TYPES}
    by_key: dict[tuple, Part] = {}
    for instance in depsgraph.object_instances:
        original = instance.parent.original if instance.is_instance and instance.parent else instance.object.original
        if original not in ranks or instance.object.type != "MESH":
            continue
        instanced = instance.is_instance and original.type == "EMPTY"
        # Instances that a mesh object generates itself (geometry nodes, particles) belong to it.
        key = (ranks[original], *(instance.persistent_id if instanced else ()))
        part = by_key.get(key)
        if part is None:
            name = f"{original.name}/{instance.object.name}" if instanced else original.name
            part = by_key[key] = Part(0, name, "", original)
        data = instance.object.data
        part.own &= (
            not instance.is_instance
            and not part.pieces
            and original.type == "MESH"
            and same_topology(data, original.data)
        )
        vertices, loops = vertices_of(data, instance.matrix_world), triangles_of(data, "loops")
        if not np.isfinite(vertices).all():
            raise BadInputError(f"Object '{original.name}' has vertices that are not finite; mend its mesh first.")
        if instance.matrix_world.is_negative:  # mirrored: the front is given by the reverse order of corners
            loops = loops[:, [0, 2, 1]]
        part.pieces.append((vertices, *faces_of(data), loops))
    parts = [by_key[key] for key in sorted(by_key) if any(len(loops) for *_, loops in by_key[key].pieces)]
    kinds: dict[bpy.types.ID, str] = {}
    for number, part in enumerate(parts):
        part.object_id = number
        part.class_name = kinds.setdefault(part.obj.data, part.name) if part.own else part.name
    return parts


def same_topology(first: bpy.types.Mesh, second: bpy.types.Mesh) -> bool:
    """Whether two meshes have the same faces in the same order, wherever their vertices are."""
    return len(first.vertices) == len(second.vertices) and all(
        np.array_equal(a, b) for a, b in zip(faces_of(first), faces_of(second))
    )


def topology_hash(pieces: Iterable[tuple[np.ndarray, np.ndarray]]) -> str:
    """A hash of what `faces_of` gives, piece by piece."""
    digest = hashlib.sha256()
    for starts, corners in pieces:
        digest.update(np.int64([len(starts), len(corners)]).tobytes() + starts.tobytes() + corners.tobytes())
    return digest.hexdigest()


def joined(parts: Iterable[Part]) -> SceneMesh:
    """One mesh of all parts; triangles keep the order of the objects' faces."""
    columns = vertices, starts, corners, loops, ids = [], [], [], [], []
    first_vertex = first_corner = 0
    corner_start = {}
    for part in parts:
        corner_start[part.object_id] = first_corner
        for points, start, corner, loop in part.pieces:
            offset_arrays = points, start[:-1] + first_corner, corner + first_vertex, loop + first_corner
            for column, values in zip(columns, (*offset_arrays, np.full(len(loop), part.object_id))):
                column.append(values)
            first_vertex += len(points)
            first_corner += len(corner)
    start, corner, loop, ids = (np.concatenate(arrays).astype(np.int32) for arrays in (starts, corners, loops, ids))
    polygons = Polygons(np.append(start, np.int32(first_corner)), corner, loop)
    return SceneMesh(np.concatenate(vertices), corner[loop], ids, polygons, corner_start)
