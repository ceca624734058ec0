"""A mesh's vertices joined where they lie in one place, and what follows for its neighbourhoods."""

import numpy as np
from scipy import sparse

from .model import Mesh
from .params import SURFACE


def same_place(vertices: np.ndarray, tolerance: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Number the places that vertices lie at.

    Parameters
    ----------
    vertices : (v, 3) float
        Finite.
    tolerance : float
        Metres. Vertices in one cell of a grid of this size are one; 0: equal to the last bit.

    Returns
    -------
    first : (p,) int
        A vertex of each place.
    place : (v,) int64
        The place of each vertex.
    """
    # Rounded, not cut off: what lies on round numbers, as a drawn room does, is then in the middle of a cell.
    cells = np.round(vertices / tolerance) if tolerance > 0 else vertices
    # As np.unique along an axis numbers them, in two fifths of its time.
    order = np.lexsort(cells.T[::-1])
    ordered = cells[order]
    new = np.ones(len(order), bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(1)
    place = np.empty(len(order), np.int64)
    place[order] = np.cumsum(new) - 1
    return order[new], place


def one_place(vertices: np.ndarray) -> float:
    """Metres within which vertices ((v, 3), finite) are one: at seams they are listed twice."""
    return max(SURFACE.weld * float(np.linalg.norm(np.ptp(vertices, axis=0))), 1e-12)


def weld(vertices: np.ndarray) -> np.ndarray:
    """A number for each place that vertices ((v, 3), finite) lie at, (v,) int64."""
    return same_place(vertices - vertices.min(0), one_place(vertices))[1]


def welded(mesh: Mesh, tolerance: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices in one place as one point: at seams a mesh lists them twice.

    Parameters
    ----------
    tolerance : float
        See `same_place`.

    Returns
    -------
    points : (p, 3) float64
    faces : (t, 3) int
        Triangles by points.
    place : (v,) int
        The point of each vertex.
    """
    first, place = same_place(mesh.vertices, tolerance)
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
