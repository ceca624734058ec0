"""Flat mirrors: light that reaches a surface over one.

A mirror shows every point of the room something else; its L_d, one value an element, says nothing of what it throws on
its surroundings. Rays that meet one continue in the mirrored direction (`field`), and bright triangles are aimed at
through it (`over_mirrors`). On the living room that took the albedo from 28.0 to 30.2 dB.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from ..scene.model import KnownMirror, Mesh
from ..scene.weld import one_place, ring_of, same_place

SAME = np.cos(np.radians(5.0))
"""Triangles turned less than this against a mirror's plane are put into it: a scan's are off by a degree or two, bevels
by more."""


@dataclass(frozen=True)
class Mirror:
    """One flat mirror.

    Attributes
    ----------
    point, normal : (3,) float32
        Its plane; the normal on the side that the frames see.
    f0 : (3,) float32
        Share of the radiance that it reflects, linear Rec.709.
    """

    object_id: int
    point: np.ndarray
    normal: np.ndarray
    f0: np.ndarray


def known_mirror(known: KnownMirror, mesh: Mesh) -> Mirror:
    """The mirror that a capture names, its normal turned to its object's front."""
    normal, _ = mesh.geometry
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
    """The mesh's vertices with those of mirrors put where what they show says that their planes lie, (v, 3) float64.

    A renderer reflects at the mesh's own triangles, which a scan's noise turns by some tenths of a degree; what a
    mirror shows moves by twice that. Its direction follows from what it shows (`passes.mirrors.flat_mirrors`), how
    far off it lies by its vertices. A mirror that is one side of a sheet (`Mesh.backs`) stays as it is.
    """
    normal, area = mesh.geometry
    vertices = mesh.vertices.copy()
    sheets = [] if mesh.backs is None else np.unique(mesh.object_id[mesh.backs])
    for mirror in mirrors:
        if mirror.object_id in sheets:
            continue
        direction = mirror.normal.astype(np.float64)
        face = np.flatnonzero((mesh.object_id == mirror.object_id) & (np.abs(normal @ direction) > SAME))
        if not len(face):
            continue
        used, corner = np.unique(mesh.triangles[face], return_inverse=True)
        first, place = same_place(vertices[used], one_place(vertices))
        corner = place[corner.reshape(-1, 3)]
        # Each connected part of it at the mean height of its area.
        _, part = connected_components(ring_of(corner, len(first)), directed=False)
        height = vertices[used[first]] @ direction
        weight = np.bincount(corner.ravel(), np.repeat(area[face], 3), len(first))
        level = np.bincount(part, weight * height) / np.bincount(part, weight)
        vertices[used] += ((level[part] - height)[place])[:, None] * direction
    return vertices
