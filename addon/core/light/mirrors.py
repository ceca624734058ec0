"""Flat mirrors: light that reaches a surface over one.

A mirror shows every point of the room something else; its L_d, one value an element, says nothing of what it throws on
its surroundings. Rays that meet one go on in the mirrored direction (`field`), and bright triangles are aimed at
through it (`over_mirrors`). On the living room that took the albedo from 28.0 to 30.2 dB.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from ..scene.elements import triangle_geometry
from ..scene.model import KnownMirror, Mesh
from ..scene.weld import same_place

SAME = np.cos(np.radians(5.0))
"""Triangles turned less than this against a mirror's plane are put into it: a scan's are off by a degree or two, bevels
by more."""
SAME_PLACE = 1e-5
"""Metres."""
FIRM = 1e6
"""How much more a triangle's way counts than its points' places."""


@dataclass(frozen=True)
class Mirror:
    """One flat mirror.

    Attributes
    ----------
    object_id : int
    point, normal : (3,) float32
        Its plane; the normal on the side that the frames see.
    f0 : (3,) float32
        Share of the radiance that it reflects, linear Rec.709.
    facets : (k,) int32
        Triangles of its bevels, where what they show told them from the plane.
    facing : (k, 3) float32
        The normals of those.
    """

    object_id: int
    point: np.ndarray
    normal: np.ndarray
    f0: np.ndarray
    facets: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    facing: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.float32))

    def as_lists(self) -> dict[str, Any]:
        """For JSON."""
        return {name: np.asarray(value).tolist() for name, value in asdict(self).items()}

    @staticmethod
    def from_lists(known: dict[str, Any]) -> Mirror:
        """What `as_lists` gave."""
        point, normal, f0 = (np.asarray(known[name], np.float32) for name in ("point", "normal", "f0"))
        facing = np.asarray(known["facing"], np.float32).reshape(-1, 3)
        return Mirror(known["object_id"], point, normal, f0, np.asarray(known["facets"], np.int32), facing)


def known_mirror(known: KnownMirror, mesh: Mesh) -> Mirror:
    """The mirror that a capture tells of, its normal turned to its object's front."""
    normal, _ = triangle_geometry(mesh)
    turn = -1.0 if (normal[mesh.object_id == known.object_id] @ known.normal).sum() < 0 else 1.0
    return Mirror(
        known.object_id,
        known.point.astype(np.float32),
        (turn * known.normal).astype(np.float32),
        np.full(3, known.reflectivity, np.float32),
    )


def reflect(vectors: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Directions ((n, 3)) mirrored at a plane with the given unit normal ((3,))."""
    return vectors - 2 * (vectors @ normal)[:, None] * normal


def in_their_planes(mesh: Mesh, mirrors: tuple[Mirror, ...]) -> np.ndarray:
    """The mesh's vertices with those of mirrors put where the room that they show says that their planes lie.

    A renderer reflects at the mesh's own triangles, which a scan's noise turns by some tenths of a degree; what a
    mirror shows moves by twice that. Which way it and its bevels face is told by what they show
    (`specular.flat_mirrors`, `specular.facets`), how far off it lies by its vertices. A mirror that is one side of a
    sheet (`Mesh.backs`) stays as it is.

    Returns
    -------
    (v, 3) float64
    """
    normal, area = triangle_geometry(mesh)
    vertices = mesh.vertices.copy()
    sheets = [] if mesh.backs is None else np.unique(mesh.object_id[mesh.backs])
    for mirror in mirrors:
        if mirror.object_id in sheets:
            continue
        way = mirror.normal.astype(np.float64)
        face = (mesh.object_id == mirror.object_id) & (np.abs(normal @ way) > SAME)
        face[mirror.facets] = True
        face = np.flatnonzero(face)
        if not len(face):
            continue
        # A plane's rise along its normal `way`, for a step across: - (facing . step) / (facing . way).
        facing = np.broadcast_to(way, (len(mesh.triangles), 3)).copy()
        facing[mirror.facets] = mirror.facing
        own, corner = np.unique(mesh.triangles[face], return_inverse=True)
        first, place = same_place(vertices[own], SAME_PLACE)
        corner = place[corner.reshape(-1, 3)]
        height = vertices[own] @ way
        flat = vertices[own] - height[:, None] * way
        height = _heights(corner, flat[first], height[first], facing[face], way, area[face])[place]
        vertices[own] = flat + height[:, None] * way
    return vertices


def _heights(corner: np.ndarray, flat: np.ndarray, height: np.ndarray, facing: np.ndarray, way: np.ndarray,
             area: np.ndarray) -> np.ndarray:  # fmt: skip
    """Heights ((p,)) over a plane at which triangles ((t, 3) `corner`s) face as they are said to, near those given."""
    start, end = corner[:, [0, 1, 2]].ravel(), corner[:, [1, 2, 0]].ravel()
    towards = np.repeat(facing / (facing @ way)[:, None], 3, 0)
    rise = -((flat[end] - flat[start]) * towards).sum(1)
    firm = FIRM * np.repeat(area, 3)
    rows = np.arange(len(start))
    step = sparse.csr_matrix((np.r_[np.ones(len(start)), -np.ones(len(start))], (np.r_[rows, rows], np.r_[end, start])),
                             (len(start), len(height)))  # fmt: skip
    near = np.bincount(corner.ravel(), np.repeat(area, 3), len(height))
    system = step.T @ sparse.diags(firm) @ step + sparse.diags(near)
    return np.atleast_1d(spsolve(system.tocsc(), step.T @ (firm * rise) + near * height))
