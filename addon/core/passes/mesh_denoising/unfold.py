"""Where noise has folded a mesh's triangles over, angles are no guide: points are drawn towards their neighbours first.

Two thin plates on the graph of edges, each the stiffer the shorter its edges truly are against the noise. One goes by
a point's edges as they are, on the whole. The other goes by its shortest ones, and only where points are crowded: as
the strips of a moulding, a millimetre wide and metres long, or a small thing scanned finely. There many points
together tell what each by itself does not, and `denoise` has nothing to add.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import cg
from scipy.spatial import cKDTree

from ...scene.weld import ring_of
from .params import UNFOLD


def unfolded(points: np.ndarray, faces: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Draw points towards their neighbours where edges are short against the noise.

    Parameters
    ----------
    points : (p, 3) float64
    faces : (t, 3) int
    noise : float
        Standard deviation along the normal, in metres.

    Returns
    -------
    points : (p, 3) float64
    crowded : (p,) float64
        0 where a point speaks for itself, 1 where only a crowd of them does.
    """
    ring = ring_of(faces, len(points))
    near = ring.tocoo()
    length = np.linalg.norm(points[near.row] - points[near.col], axis=1)
    by_length, by_shortest = (_mean(near, 1 / np.maximum(length, noise) ** power) for power in (1, 2))
    stiff = (2 * noise / _true(_usual_length(near, length), noise)) ** 4
    fine = noise / _true(_shortest_length(near, length, by_shortest), noise)
    crowded = _in_crowds(points, noise) * np.clip(fine - UNFOLD.fine, 0, 1)
    system = sparse.eye(len(points))
    # Points of no triangle, as of parts too small to have a shape, have nothing to be drawn to.
    meant = sparse.diags(np.diff(ring.indptr) > 0, dtype=float)
    for mean, stiffness in ((by_length, stiff), (by_shortest, crowded * fine**4)):
        bend = meant - mean
        system = system + bend.T @ sparse.diags(stiffness) @ bend
    system = system.tocsr()
    return np.stack([solved(system, points[:, axis], points[:, axis]) for axis in range(3)], 1), crowded


def solved(system: sparse.csr_matrix, right: np.ndarray, guess: np.ndarray | None = None) -> np.ndarray:
    """The solution of a symmetric positive definite system, by conjugate gradients."""
    scaled = sparse.diags(1 / system.diagonal())
    return cg(system, right, guess, rtol=UNFOLD.tolerance, maxiter=UNFOLD.most_steps, M=scaled)[0]


def _mean(near: sparse.coo_matrix, weight: np.ndarray) -> sparse.csr_matrix:
    """Mean over neighbours, (p, p), each with its weight."""
    total = np.bincount(near.row, weight, near.shape[0])
    return sparse.csr_matrix((weight / np.maximum(total, 1e-300)[near.row], (near.row, near.col)), near.shape)


def _usual_length(near: sparse.coo_matrix, length: np.ndarray) -> np.ndarray:
    """Root mean square of the edges at each point, (p,)."""
    degree = np.bincount(near.row, minlength=near.shape[0])
    return np.sqrt(np.bincount(near.row, length**2, len(degree)) / np.maximum(degree, 1))


def _shortest_length(near: sparse.coo_matrix, length: np.ndarray, mean: sparse.csr_matrix) -> np.ndarray:
    """Length of the shortest edges around each point, (p,): the `mean` that counts them most, of the logarithm."""
    own = mean.multiply(sparse.csr_matrix((np.log(np.maximum(length, 1e-9)), (near.row, near.col)), near.shape))
    result = np.asarray(own.sum(1))[:, 0]
    for _ in range(2):
        result = (result + mean @ result) / 2
    return np.exp(result)


def _true(length: np.ndarray, noise: float) -> np.ndarray:
    """What lengths are without the noise of both ends that is in them as measured."""
    return np.sqrt(np.maximum(length**2 - 2 * noise**2, (UNFOLD.shortest * noise) ** 2))


def _in_crowds(points: np.ndarray, noise: float) -> np.ndarray:
    """Points that have `crowd` nearby, (p,) bool."""
    distance, _ = cKDTree(points).query(points, [UNFOLD.crowd], distance_upper_bound=UNFOLD.near * noise)
    return np.isfinite(distance[:, 0])
