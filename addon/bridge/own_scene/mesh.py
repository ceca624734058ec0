"""Objects of the open scene as one mesh of triangles, and the way back from each triangle to its face.

What is read is what the viewport shows: modifiers and instances evaluated, in world space. Materials are told by
object, so each object becomes an instance of the capture; so does each object that an instanced collection shows.
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.errors import BadInputError
from ..data.arrays import faces_of, make_mesh, triangles_of, vertices_of
from ..data.unwrap import Polygons

KINDS = ("MESH", "CURVE", "SURFACE", "FONT", "EMPTY")
"""Types of object that may have faces to show; an empty has those of the collection that it instances."""


@dataclass
class Part:
    """One instance of the capture.

    Attributes
    ----------
    name : str
        As the artist reads it.
    class_name : str
        Objects of one mesh share it, as they are of one kind.
    thing : bpy.types.Object
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
    thing: bpy.types.Object
    own: bool = True
    pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=list)

    @property
    def topology(self) -> str:
        """A hash of what its faces connect; stays the same where vertices are only moved."""
        return topology_hash([piece[1:3] for piece in self.pieces])

    def mesh(self) -> bpy.types.Mesh:
        """Its faces as a mesh of their own, in world coordinates, flat."""
        one = joined([self])
        return make_mesh(self.name, one.vertices, one.polygons.vertex, one.polygons.start[:-1])


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


def gather(depsgraph: bpy.types.Depsgraph, things: Iterable[bpy.types.Object]) -> list[Part]:
    """Read what the objects show.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Brought up to date.
    things : iterable of bpy.types.Object
        The artist's; those without a surface are passed over.

    Returns
    -------
    list of Part
        In the order of `things`; one without faces is left out. Same scene, same numbers.

    Raises
    ------
    BadInputError
        An object has vertices that are not finite.
    """
    wanted = {thing: rank for rank, thing in enumerate(things) if thing.type in KINDS}
    found: dict[tuple, Part] = {}
    for shown in depsgraph.object_instances:
        owner = shown.parent.original if shown.is_instance and shown.parent else shown.object.original
        if owner not in wanted or shown.object.type != "MESH":
            continue
        instanced = shown.is_instance and owner.type == "EMPTY"
        # What a mesh object spreads over itself (geometry nodes, particles) belongs to it.
        key = (wanted[owner], *(shown.persistent_id if instanced else ()))
        part = found.get(key)
        if part is None:
            name = f"{owner.name}/{shown.object.name}" if instanced else owner.name
            part = found[key] = Part(0, name, "", owner)
        data = shown.object.data
        part.own &= (
            not shown.is_instance and not part.pieces and owner.type == "MESH" and same_topology(data, owner.data)
        )
        vertices, loops = vertices_of(data, shown.matrix_world), triangles_of(data, "loops")
        if not np.isfinite(vertices).all():
            raise BadInputError(f"Object '{owner.name}' has vertices that are not finite; mend its mesh first.")
        if shown.matrix_world.is_negative:  # mirrored: front is where the other order of corners says
            loops = loops[:, [0, 2, 1]]
        part.pieces.append((vertices, *faces_of(data), loops))
    parts = [found[key] for key in sorted(found) if any(len(loops) for *_, loops in found[key].pieces)]
    kinds: dict[bpy.types.ID, str] = {}
    for number, part in enumerate(parts):
        part.object_id = number
        part.class_name = kinds.setdefault(part.thing.data, part.name) if part.own else part.name
    return parts


def same_topology(one: bpy.types.Mesh, other: bpy.types.Mesh) -> bool:
    """Whether two meshes have the same faces in the same order, wherever their vertices are."""
    return len(one.vertices) == len(other.vertices) and all(
        np.array_equal(a, b) for a, b in zip(faces_of(one), faces_of(other))
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
            shifted = points, start[:-1] + first_corner, corner + first_vertex, loop + first_corner
            for column, values in zip(columns, (*shifted, np.full(len(loop), part.object_id))):
                column.append(values)
            first_vertex += len(points)
            first_corner += len(corner)
    start, corner, loop, ids = (np.concatenate(one).astype(np.int32) for one in (starts, corners, loops, ids))
    polygons = Polygons(np.append(start, np.int32(first_corner)), corner, loop)
    return SceneMesh(np.concatenate(vertices), corner[loop], ids, polygons, corner_start)
