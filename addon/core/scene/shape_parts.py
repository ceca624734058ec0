"""Objects for a mesh that was fused from depth and names none: its large planes, and pieces between its creases.

A room that a depth camera or a phone scanned is one connected mesh, and gets one material unless it is segmented. Here
its shape does: large planes first (floor, ceiling, walls, table tops), then what is smooth, joined over convex edges
(two things that touch meet in a concave one: Hoffman and Richards, 1984). In three rooms fused from noisy depth 83 to
92 % of the surface lay in a part whose majority was that object.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..kinds import Code
from .connected_parts import connected_parts, to_nearest
from .model import Mesh
from .params import PARTS, SURFACE
from .sphere import fibonacci
from .uv_islands import components
from .weld import weld

WALL: Code[str] = "wall"
"""What upright planes are called that the room lies in front of."""


@dataclass(frozen=True)
class Plane:
    """A plane of a mesh.

    Attributes
    ----------
    normal, point : (3,) float64
        Its unit normal, towards the side that was seen, and a point on it.
    faces : (f,) int
        Its triangles.
    part : int
        The part that they are most of.
    name : str
        'floor', 'ceiling' or 'wall' where (nearly) all of the mesh lies in front of it, '' else.
    """

    normal: np.ndarray
    point: np.ndarray
    faces: np.ndarray
    part: int = -1
    name: str = ""


class Parts(NamedTuple):
    """A mesh taken apart.

    Attributes
    ----------
    part : (t,) int
        Of each triangle, from 0, the largest surface first.
    names : dict of int to str
        What parts are by their shape, or their number.
    """

    part: np.ndarray
    names: dict[int, str]
    planes: tuple[Plane, ...] = ()


class _Faces:
    """Triangles: centres, areas, normals with less noise; pairs `a`, `b` at an edge, its length, if it is `smooth`."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray):
        corners = vertices[triangles]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        double = np.linalg.norm(cross, axis=1)
        self.count, self.centre, self.area = len(triangles), corners.mean(1), double / 2
        ends = np.sort(np.stack([triangles[:, [1, 2]], triangles[:, [2, 0]], triangles[:, [0, 1]]], 1), 2)
        ends = ends.reshape(-1, 2).astype(np.int64)
        key = ends[:, 0] * len(vertices) + ends[:, 1]
        order = np.argsort(key, kind="stable")
        same = np.flatnonzero(key[order][1:] == key[order][:-1])
        self.a, self.b = order[same] // 3, order[same + 1] // 3
        self.length = np.linalg.norm(np.subtract(*vertices[ends[order[same]]].swapaxes(0, 1)), axis=1)
        self.normal = self._filtered(cross / np.maximum(double, 1e-300)[:, None])
        self.smooth = self._angles(self.normal) < PARTS.smooth

    def _filtered(self, normal: np.ndarray) -> np.ndarray:
        """Bilateral filter of the normals, which keeps creases (Zheng et al., 2011)."""
        pairs = np.concatenate([self.a, self.b]), np.concatenate([self.b, self.a])
        for _ in range(PARTS.rounds):
            weight = np.exp(-0.5 * (self._angles(normal) / PARTS.crease) ** 2)
            areas = np.concatenate([weight * self.area[self.b], weight * self.area[self.a]])
            normal = sparse.csr_matrix((areas, pairs), (self.count, self.count)) @ normal + self.area[:, None] * normal
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        return normal

    def _angles(self, normal: np.ndarray) -> np.ndarray:
        return np.arccos(np.clip((normal[self.a] * normal[self.b]).sum(1), -1, 1))

    def bends(self) -> np.ndarray:
        """Angle at each pair's edge, above 0 where it is convex, (p,)."""
        outward = ((self.centre[self.b] - self.centre[self.a]) * self.normal[self.a]).sum(1)
        return self._angles(self.normal) * np.where(outward < 0, 1, -1)

    def pieces(self, joined: np.ndarray) -> np.ndarray:
        """Connected components of the triangles over the pairs that are `joined`, (t,) int from 0."""
        return components(self.a[joined], self.b[joined], self.count)

    def largest(self, chosen: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """The connected component with the largest area among the triangles `chosen` ((k,) int), (n,) int.

        `pairs`, (p,) int, are those that may connect them.
        """
        if not len(chosen):
            return chosen
        local_index = np.full(self.count, -1)
        local_index[chosen] = np.arange(len(chosen))
        a, b = local_index[self.a[pairs]], local_index[self.b[pairs]]
        joined = (a >= 0) & (b >= 0)
        piece = components(a[joined], b[joined], len(chosen))
        return chosen[piece == self.most(piece, chosen)]

    def most(self, label: np.ndarray, members: np.ndarray) -> int:
        """The label that most of the area of the triangles `members` has; `label`, (m,) int, of each of them."""
        return int(np.bincount(label, self.area[members]).argmax())


def _cells(faces: _Faces, gap: float) -> np.ndarray:
    """The cell of (direction, offset) that each triangle lies in, (t,) int."""
    directions = fibonacci(PARTS.directions)
    nearest = cKDTree(directions).query(faces.normal)[1]
    offset = np.floor((faces.centre * directions[nearest]).sum(1) / (2 * gap)).astype(np.int64)
    return np.unique(np.stack([nearest, offset], 1), axis=0, return_inverse=True)[1].ravel()


def _planes(faces: _Faces, cell: np.ndarray, gap: float, least: float, free: np.ndarray) -> list[Plane]:
    """Planes, the best supported first: the densest `cell`, then least squares.

    Each has the share `least` of the surface at least, among the triangles that are `free` ((t,) bool).
    """
    minimum_area = least * faces.area.sum()
    free, planes = free.copy(), []
    support = np.bincount(cell, faces.area * free)
    while support.max() > PARTS.seed * minimum_area:
        seed = np.flatnonzero((cell == support.argmax()) & free)
        plane = _plane_at(faces, seed, free, gap)
        large = plane is not None and faces.area[plane.faces].sum() >= minimum_area
        if plane is not None and large and not _is_curved(faces, plane.faces, plane.normal):
            planes.append(plane)
            taken = plane.faces
        else:
            taken = seed  # no plane's seed any more, and none's triangles
        free[taken] = False
        support -= np.bincount(cell[taken], faces.area[taken], len(support))
    return planes


def _plane_at(faces: _Faces, seed: np.ndarray, free: np.ndarray, gap: float) -> Plane | None:
    """The plane through the triangles `seed`, with the `free` ones ((t,) bool) that lie in it and are connected."""
    facing = faces.area[seed] @ faces.normal[seed]
    alike = free & (faces.normal @ facing > np.cos(2 * PARTS.tilt) * np.linalg.norm(facing))
    candidates, pairs = np.flatnonzero(alike), np.flatnonzero(alike[faces.a] & alike[faces.b])
    members = seed
    for _ in range(PARTS.fits):
        weight = faces.area[members]
        point = np.average(faces.centre[members], 0, weight)
        weighted_offset = (faces.centre[members] - point) * np.sqrt(weight)[:, None]
        normal = np.linalg.eigh(weighted_offset.T @ weighted_offset)[1][:, 0]
        normal *= np.sign(normal @ (weight @ faces.normal[members])) or 1
        near = candidates[np.abs((faces.centre[candidates] - point) @ normal) < gap]
        aligned = near[faces.normal[near] @ normal > np.cos(PARTS.tilt)]
        members = faces.largest(aligned, pairs)
        if not len(members):
            return None
    # A wall at the far end of what the camera's depth reaches is islands: what bounds the room need not be connected.
    return Plane(normal, point, aligned if _bounds(faces, point, normal, gap) else members)


def _bounds(faces: _Faces, point: np.ndarray, normal: np.ndarray, gap: float) -> bool:
    """Whether (nearly) all of the mesh lies in front of a plane."""
    inside = faces.centre @ normal > point @ normal - gap
    return bool(faces.area @ inside >= PARTS.outer * faces.area.sum())


def _is_curved(faces: _Faces, members: np.ndarray, normal: np.ndarray) -> bool:
    """Whether the triangles `members` lie on a curved surface: their normals vary, and it continues beyond them."""
    deviation = np.median(np.arccos(np.clip(faces.normal[members] @ normal, -1, 1)))
    inside = np.bincount(members, minlength=faces.count) > 0
    border = inside[faces.a] != inside[faces.b]
    continues = faces.length[border & faces.smooth].sum() > faces.length[border].sum() / 2
    return bool(continues and deviation > PARTS.smooth / 2)


def _borders(faces: _Faces, piece: np.ndarray, weight: np.ndarray) -> sparse.csr_matrix:
    """The sum of `weight` over the edges that two pieces share, (k, k), symmetric."""
    x, y = piece[faces.a], piece[faces.b]
    apart = x != y
    pairs = np.concatenate([x[apart], y[apart]]), np.concatenate([y[apart], x[apart]])
    count = int(piece.max()) + 1
    return sparse.csr_matrix((np.tile(weight[apart], 2), pairs), (count, count))


def _without_crumbs(faces: _Faces, piece: np.ndarray) -> np.ndarray:
    """The pieces again, each that is small a part of the neighbour with which it shares the longest border.

    What is connected with nothing joins what is nearest.
    """
    minimum_area = SURFACE.tiny * faces.area.sum()
    while True:
        border = _borders(faces, piece, faces.length)
        crumb, alone = np.bincount(piece, faces.area) < minimum_area, np.diff(border.indptr) == 0
        if not (crumb & ~alone).any():
            piece = to_nearest(np.where((crumb & alone)[piece], -1, piece), faces.centre)
            return np.unique(piece, return_inverse=True)[1].ravel()
        small = np.flatnonzero(crumb & ~alone)
        neighbour = np.asarray(border.argmax(1)).ravel()[small]
        piece = components(small, neighbour, len(crumb))[piece]


def _over_convex_edges(faces: _Faces, piece: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """The pieces again; those not `flat` ((k,) bool) joined where they meet, on average, in no concave edge."""
    border = _borders(faces, piece, faces.length)
    bend = _borders(faces, piece, faces.length * faces.bends()).tocoo()
    mean = bend.data / np.asarray(border[bend.row, bend.col]).ravel()
    joined = (mean > -PARTS.concave) & ~flat[bend.row] & ~flat[bend.col]
    return components(bend.row[joined], bend.col[joined], len(flat))[piece]


def _name(plane: Plane, faces: _Faces, gap: float) -> str:
    """'floor', 'ceiling' or 'wall' where (nearly) all of the mesh lies in front of a plane; '' else."""
    if not _bounds(faces, plane.point, plane.normal, gap):
        return ""
    up, slant = plane.normal[2], np.sin(PARTS.tilt)
    if abs(up) < slant:
        return WALL
    return ("floor" if up > 0 else "ceiling") if abs(up) > np.cos(PARTS.tilt) else ""


def shape_parts(vertices: np.ndarray, triangles: np.ndarray) -> Parts:
    """Take a mesh apart by its shape; of its parts the outermost planes have names.

    Parameters
    ----------
    vertices : (v, 3) float64
        Welded: what touches shares them. +Z up; any unit of length.
    triangles : (t, 3) int
    """
    faces = _Faces(vertices, triangles)
    gap = plane_gap(vertices[triangles.ravel()])
    cell = _cells(faces, gap)
    planes = _planes(faces, cell, gap, PARTS.plane, np.ones(faces.count, bool))
    label = np.full(faces.count, -1)
    for k, plane in enumerate(planes):
        label[plane.faces] = k
    x, y = label[faces.a], label[faces.b]
    piece = _without_crumbs(faces, faces.pieces(np.where((x >= 0) | (y >= 0), x == y, faces.smooth)))
    piece_of_plane = [faces.most(piece[plane.faces], plane.faces) for plane in planes]
    flat = np.zeros(piece.max() + 1, bool)
    flat[piece_of_plane] = True
    first = np.unique(piece, return_index=True)[1]  # a triangle of each piece, to find it again
    joined = _over_convex_edges(faces, piece, flat)
    part = np.argsort(np.argsort(-np.bincount(joined, faces.area), kind="stable"))[joined]
    named_planes = [
        replace(plane, part=int(part[first[plane_piece]]), name=_name(plane, faces, gap))
        for plane_piece, plane in zip(piece_of_plane, planes, strict=True)
    ]
    small_planes = [
        replace(plane, part=faces.most(part[plane.faces], plane.faces))
        for plane in _planes(faces, cell, gap, PARTS.small, label < 0)
    ]
    names = {plane.part: plane.name for plane in named_planes if plane.name}
    return Parts(part, names, (*named_planes, *small_planes))


def plane_gap(points: np.ndarray) -> float:
    """How far off a plane its triangles may lie in a mesh of these points ((n, 3)), in its unit."""
    return PARTS.gap * float(np.linalg.norm(np.ptp(points, axis=0)))


def parts_of(vertices: np.ndarray, triangles: np.ndarray) -> Parts:
    """Objects for a mesh that names none: its connected parts, or, where most of it is connected, parts by its shape.

    Parameters
    ----------
    vertices : (v, 3) float64
    triangles : (t, 3) int
        At least one; vertices used are finite.
    """
    part, names, planes = Parts(connected_parts(vertices, triangles), {})
    area = Mesh(vertices, triangles, part).geometry[1]
    if 2 * area[part == 0].sum() > area.sum():
        used, corner = np.unique(triangles.ravel(), return_inverse=True)
        place = weld(vertices[used])[corner.ravel()]
        point = np.empty((int(place.max()) + 1, 3))
        point[place] = vertices[triangles.ravel()]
        part, names, planes = shape_parts(point, place.reshape(-1, 3))
    count = int(part.max()) + 1
    return Parts(part, {i: f"part_{i}" for i in range(count)} | names if count > 1 else {0: "room"}, planes)
