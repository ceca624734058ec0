"""Flat mirrors: light that reaches a surface over one.

A mirror shows every point of the room something else; its L_d, one value an element, says nothing of what it throws on
its surroundings. Rays that meet one go on in the mirrored direction (`field`), and bright triangles are aimed at
through it (`over_mirrors`). On the living room that took the albedo from 28.0 to 30.2 dB.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..capture.model import KnownMirror, Mesh
from ..surface.elements import triangle_geometry

if TYPE_CHECKING:
    from .field import LightField


SAME = np.cos(np.radians(5.0))
"""Triangles turned less than this against a mirror's plane are put into it: a scan's are off by a degree or two, bevels
by more."""


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
    """

    object_id: int
    point: np.ndarray
    normal: np.ndarray
    f0: np.ndarray


def known_mirror(known: KnownMirror, field: LightField) -> Mirror:
    """The mirror that a capture tells of, its normal turned to its object's front."""
    own = field.mesh.object_id == known.object_id
    turn = -1.0 if (field.normal[own] @ known.normal).sum() < 0 else 1.0
    return Mirror(known.object_id, np.float32(known.point), np.float32(turn * known.normal),
                  np.full(3, known.reflectivity, np.float32))


def reflect(vectors: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Directions ((n, 3)) mirrored at a plane with the given unit normal ((3,))."""
    return vectors - 2 * (vectors @ normal)[:, None] * normal


def in_their_planes(mesh: Mesh, mirrors: tuple[Mirror, ...]) -> np.ndarray:
    """The mesh's vertices with those of mirrors put where the room that they show says that their planes lie.

    A renderer reflects at the mesh's own triangles, which a scan's noise turns by some tenths of a degree; what a
    mirror shows moves by twice that. Which way it faces is told by what it shows (`specular.flat_mirrors`), how far off
    it lies by its vertices. A mirror that is one side of a sheet (`Mesh.backs`) stays as it is.

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
        flat = np.flatnonzero((mesh.object_id == mirror.object_id) & (np.abs(normal @ way) > SAME))
        if not len(flat):
            continue
        corners = vertices[mesh.triangles[flat]]
        centre = np.average(corners.mean(1), axis=0, weights=area[flat])
        own = np.unique(mesh.triangles[flat])
        vertices[own] -= ((vertices[own] - centre) @ way)[:, None] * way
    return vertices
