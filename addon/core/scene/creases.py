"""Near a crease an element's irradiance is uncertain: texel, pixels and facets mix the light of both sides."""

from dataclasses import replace

import numpy as np

from ..kinds import Block
from ..parallel import blocks
from .atlas import Atlas
from .model import Mesh
from .params import CREASES
from .two_sides import flipped, fronts
from .weld import one_place, welded

AT_ONCE: Block[int] = 1 << 17
"""Elements that are looked at together."""


def edge_angles(mesh: Mesh, wanted: np.ndarray | None = None) -> np.ndarray:
    """Angle in radians, 0...pi/2, by which the surface bends at each triangle's edges, (t, 3); edge k lies opposite
    corner k. Windings don't matter. Where an edge has no other triangle, pi/2: what is beyond is not known. 0 at a
    sliver's edges. A sheet's second side bends as its first one does. Of triangles that are not `wanted` ((t,) bool),
    anything."""
    if mesh.backs is not None:
        single, sheet = fronts(mesh)
        wanted_fronts = None if wanted is None else np.bincount(sheet, wanted, len(single.triangles)) > 0
        angle = edge_angles(single, wanted_fronts)
        return np.concatenate([angle, flipped(angle[mesh.backs])])
    points, faces, _ = welded(mesh, one_place(mesh.vertices))
    if wanted is not None:
        # Triangles that share an edge have two of its points: the others don't matter, and may be most of a million.
        used = np.zeros(len(points), bool)
        used[faces[wanted]] = True
        near = np.flatnonzero(used[faces].sum(1) >= 2)
        result = np.zeros((len(faces), 3))
        result[near] = _angles(replace(mesh, triangles=mesh.triangles[near]), points, faces[near])
        return result
    return _angles(mesh, points, faces)


def _angles(mesh: Mesh, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """`edge_angles` of a mesh whose triangles are `faces` of welded `points`."""
    normal, area = mesh.geometry
    corners = mesh.vertices[mesh.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
    sliver = np.repeat(2 * area < CREASES.thin * longest**2, 3)
    ends = np.sort(np.stack([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]], 1), 2).reshape(-1, 2)
    _, edge, count = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_inverse=True, return_counts=True)
    edge = edge.ravel()
    normals = np.repeat(normal, 3, 0).astype(np.float64)
    # Each triangle against the next one at its edge, in a circle: of two, that is the other one.
    order = np.argsort(edge, kind="stable")
    start = np.cumsum(count) - count
    rank = np.arange(len(edge)) - start[edge[order]]
    following = order[start[edge[order]] + (rank + 1) % count[edge[order]]]
    cosine = np.empty(len(edge))
    cosine[order] = np.abs((normals[order] * normals[following]).sum(1))
    angle = np.arccos(np.clip(cosine, 0, 1))
    angle[count[edge] == 1] = np.pi / 2
    angle[np.bincount(edge, sliver, len(count))[edge] > 0] = 0
    return angle.reshape(-1, 3)


def crease_error(mesh: Mesh, atlas: Atlas, texel: float) -> np.ndarray:
    """Relative standard error of the irradiance for nearby creases, (n,) float32; an element is `texel` metres wide."""
    angles = edge_angles(mesh, np.bincount(atlas.triangle, minlength=len(mesh.triangles)) > 0)
    relative_error = np.zeros(len(atlas), np.float32)
    bent = np.flatnonzero((angles > 0.01 * CREASES.knee).any(1)[atlas.triangle])
    for part in blocks(len(bent), AT_ONCE):
        elements = bent[part]
        triangle, position = atlas.triangle[elements], atlas.position[elements]
        corners = mesh.vertices[mesh.triangles[triangle]].astype(np.float32)
        for k in range(3):
            a, b = corners[:, (k + 1) % 3], corners[:, (k + 2) % 3]
            direction = b - a
            direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
            offset = position - a
            offset -= (offset * direction).sum(1, keepdims=True) * direction
            near = np.maximum(1 - np.linalg.norm(offset, axis=1) / (CREASES.reach * texel), 0)
            error = CREASES.most_error * np.minimum(angles[triangle, k] * near / CREASES.knee, 1)
            relative_error[elements] = np.maximum(relative_error[elements], error)
    return relative_error
