"""A mesh's vertices joined where they lie in one place, and what that tells of its neighbourhoods."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from ..capture.model import Mesh


def welded(mesh: Mesh, tolerance: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices in one place as one point: at seams a mesh lists them twice.

    Parameters
    ----------
    tolerance : float
        Metres. Vertices in one cell of a grid of this size are one; 0: equal to the last bit.

    Returns
    -------
    points : (p, 3) float64
    faces : (t, 3) int
        Triangles by points.
    place : (v,) int
        The point of each vertex.
    """
    # Rounded, not cut off: what lies on round numbers, as a drawn room does, is then in the middle of a cell.
    cells = np.round(mesh.vertices / tolerance) if tolerance > 0 else mesh.vertices
    _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    place = place.ravel()
    return mesh.vertices[first].astype(np.float64), place[mesh.triangles], place


def ring_of(faces: np.ndarray, count: int) -> sparse.csr_matrix:
    """Which of `count` points share an edge: symmetric (p, p), 1 where they do."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    ring = sparse.csr_matrix((np.ones(len(pairs)), pairs.T), (count, count))
    ring.data[:] = 1
    return ring


def point_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals by point, (p, 3): the mean over the triangles that meet there, by area; 0 where they cancel out."""
    corners = points[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.stack([sum(np.bincount(faces[:, k], area[:, axis], len(points)) for k in range(3))
                       for axis in range(3)], 1)  # fmt: skip
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
