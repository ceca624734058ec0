"""How noisy a scanned mesh is, and by how much its triangles are tilted for it."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..capture.model import Mesh

LEAST_NOISE = 0.001
"""Metres. Below, what is measured may be shape: a modelled living room has 0.13 mm."""
LEAST_VERTICES = 100
TILT = 1.2
"""Radians by which a triangle of height 1 is tilted by vertices off by 1: each of three vertices adds its share."""
MOST = 3.0


def noise_of(mesh: Mesh) -> float:
    """Standard deviation along the normal, in metres, of what is independent from vertex to vertex.

    From each vertex's height over its neighbours, less those neighbours' own: curvature, which neighbours share, is
    gone. The median over the vertices, so that creases don't count. (The living room with 3.5 mm: 3.8 mm.)
    """
    # Vertices in one place are one: at seams they are listed twice.
    _, first, place = np.unique(mesh.vertices, axis=0, return_index=True, return_inverse=True)
    points, faces = mesh.vertices[first].astype(np.float64), place.ravel()[mesh.triangles]
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    ring = sparse.csr_matrix((np.ones(len(pairs)), pairs.T), (len(points), len(points)))
    ring.data[:] = 1
    degree = np.asarray(ring.sum(1))[:, 0]
    inner = degree >= 4
    if inner.sum() < LEAST_VERTICES:
        return 0.0
    share = sparse.diags(1 / np.maximum(degree, 1)) @ ring
    corners = points[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.stack([sum(np.bincount(faces[:, k], area[:, axis], len(points)) for k in range(3))
                       for axis in range(3)], 1)  # fmt: skip
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    height = ((points - share @ points) * normal).sum(1)
    second = height - share @ height
    # Of independent noise of 1: a vertex less the mean of d neighbours, twice.
    d = float(np.median(degree[inner]))
    return float(np.median(np.abs(second[inner])) / 0.6745 / np.sqrt((1 + 1 / d) ** 2 + 1 / d))


def tilt(mesh: Mesh) -> np.ndarray:
    """Standard deviation in radians by which noise tilts each triangle, (t,) float32; 0 for a mesh without noise.

    That is about the relative error of the irradiance there: of light from one side, E changes with the cosine.
    """
    noise = noise_of(mesh)
    if noise < LEAST_NOISE:
        return np.zeros(len(mesh.triangles), np.float32)
    corners = mesh.vertices[mesh.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return np.minimum(TILT * noise * longest / np.maximum(area, 1e-30), MOST).astype(np.float32)
