"""Islands of a texture layout: which triangles are connected, and cutting those that waste the square."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .params import SURFACE
from .weld import same_place


def corner_ids(triangles: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Number the corners of triangles ((t, 3) int) so that two have one number where vertex and `uv` are the same.

    (t, 3) int64; `uv` is (t, 3, 2) float32.
    """
    bits = np.ascontiguousarray(uv, np.float32).view(np.int32).reshape(-1, 2)
    return same_place(np.column_stack([triangles.ravel(), bits]))[1].reshape(-1, 3)


def components(a: np.ndarray, b: np.ndarray, count: int) -> np.ndarray:
    """The connected component of each of `count` nodes, over the pairs `a`, `b` ((p,) int), (count,) int from 0."""
    graph = coo_matrix((np.ones(len(a), bool), (a, b)), (count, count))
    return connected_components(graph, directed=False)[1]


def connected(corners: np.ndarray, label: np.ndarray | None = None) -> np.ndarray:
    """Number the connected pieces of triangles that share a corner (`corner_ids`) and, if given, a label ((t,) int64).

    (t,) int64, each number from 0 on in use.
    """
    if label is not None:
        corners = corners + label[:, None] * (corners.max(initial=0) + 1)
    nodes, node = np.unique(corners.ravel(), return_inverse=True)
    a, b, c = node.reshape(-1, 3).T
    return components(np.r_[a, b], np.r_[b, c], len(nodes))[a].astype(np.int64)


def areas(uv: np.ndarray) -> np.ndarray:
    """Area of each triangle in texture space, (t,) float64."""
    a, b = (uv[:, k].astype(np.float64) - uv[:, 0] for k in (1, 2))
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def boxes(uv: np.ndarray, island: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of each island's bounding box, two (i, 2) arrays."""
    order = np.argsort(island, kind="stable")
    start = np.searchsorted(island[order], np.arange(island.max() + 1))
    return np.minimum.reduceat(uv.min(1)[order], start), np.maximum.reduceat(uv.max(1)[order], start)


def cut_sparse(
    uv: np.ndarray, corners: np.ndarray, island: np.ndarray, margin: float, face: np.ndarray | None = None
) -> np.ndarray:
    """Cut islands that fill little of their box (window frames, skirting boards) until the boxes get no smaller.

    Parameters
    ----------
    uv : (t, 3, 2) float32
    corners : (t, 3) int64
    island : (t,) int64
    margin : float
        Width that each island needs around itself, in units of `uv`.
    face : (t,) int64, optional
        Triangles of one number stay together.

    Returns
    -------
    (t,) int64, the finer numbering
    """
    area = areas(uv)
    centre = uv.mean(1, dtype=np.float64)
    face = np.arange(len(uv)) if face is None else face
    count = np.maximum(np.bincount(face), 1)
    centre = np.stack([(np.bincount(face, centre[:, k]) / count)[face] for k in (0, 1)], -1)
    final = np.zeros(len(uv), bool)
    for _ in range(SURFACE.rounds):
        low, high = boxes(uv, island)
        width = (high - low).astype(np.float64)
        fill = np.bincount(island, area) / np.maximum(width.prod(1), 1e-12)
        count = np.bincount(island)
        worth_cutting = (fill < SURFACE.full) & (width.min(1) > 4 * margin) & (count > 1)
        chosen = np.flatnonzero(worth_cutting[island] & ~final)
        if not len(chosen):
            break
        piece, parent, cost = _halves(uv, corners, island, chosen, centre, width, margin)
        before = (width + 2 * margin).prod(1)
        better = np.bincount(parent, cost, len(width)) < 1.02 * before
        # A ring of a few long triangles gains nothing from one straight cut: take it apart.
        taken_apart = ~better & (fill < SURFACE.hopeless) & (count <= 64)
        accepted = better[island[chosen]]
        final[chosen[~accepted]] = True
        finer = island.copy()
        finer[chosen[accepted]] = island.max() + 1 + piece[accepted]
        single = chosen[taken_apart[island[chosen]]]
        finer[single] = finer.max() + 1 + face[single]
        island = np.unique(finer, return_inverse=True)[1].reshape(-1)
    return island


def _halves(uv, corners, island, chosen, centre, width, margin):
    """Cut the chosen triangles' islands across their longer side: pieces, and parent and box area of each piece."""
    axis = (width[:, 1] > width[:, 0]).astype(int)[island[chosen]]
    place = centre[chosen, axis]
    order = np.lexsort((place, island[chosen]))
    owner = island[chosen][order]
    start = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]])
    stop = np.r_[start[1:], len(owner)] - 1
    middle = np.zeros(len(width))
    middle[owner[start]] = (place[order][start] + place[order][stop]) / 2
    piece = connected(corners[chosen], island[chosen] * 2 + (place > middle[island[chosen]]))
    low, high = boxes(uv[chosen], piece)
    parent = np.empty(len(low), np.int64)
    parent[piece] = island[chosen]
    return piece, parent, (high - low + 2 * margin).prod(1)
