"""Cracks that a scan's noise opens where parts of a mesh only touch.

Where a window's frame meets the wall, the frame has one long edge and the wall several short ones along it, with points
of its own. Each side is denoised by itself; a crack of a millimetre is left, and a sky as bright as a thousand walls
shines through it: half a decibel of a picture with such a window. Points of a border that runs along another border's
edge are put onto that edge.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...significance import LEVELS
from .params import PLANES


def border_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges with one triangle, (e, 2) points, and the point opposite each, (e,)."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
    opposite = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
    _, first, count = np.unique(edges, axis=0, return_index=True, return_counts=True)
    first = first[count == 1]
    return edges[first], opposite[first]


def closed(points: np.ndarray, faces: np.ndarray, noise: float) -> np.ndarray:
    """The points ((p, 3)), those along cracks moved onto the edge on the other side.

    Parameters
    ----------
    faces : (t, 3) int
    noise : float
        Metres.
    """
    edges, opposite = border_edges(faces)
    point, edge, share = _beside(points, edges, opposite, _height(points, faces), noise)
    start, end = edges[edge].T
    moved = points.copy()
    moved[point] = points[start] + share[:, None] * (points[end] - points[start])
    return moved


def _height(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Of each point over the far side of its lowest triangle, (p,)."""
    corners = points[faces]
    double = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    lowest = np.full(len(points), np.inf)
    for k in range(3):
        far = np.linalg.norm(corners[:, (k + 2) % 3] - corners[:, (k + 1) % 3], axis=1)
        np.minimum.at(lowest, faces[:, k], double / np.maximum(far, 1e-30))
    return lowest


def _beside(
    points: np.ndarray, edges: np.ndarray, opposite: np.ndarray, height: np.ndarray, noise: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of borders along others' edges: the point, the edge, and where on it (share of its length), (k,) each."""
    start, along = points[edges[:, 0]], points[edges[:, 1]] - points[edges[:, 0]]
    length = np.linalg.norm(along, axis=1)
    arm = points[opposite] - start
    over = np.linalg.norm(np.cross(along, arm), axis=1) / np.maximum(length, 1e-30)
    able = np.flatnonzero((length > PLANES.high * noise) & (over > PLANES.high * noise))
    border = np.unique(edges)
    border_able = border[height[border] > PLANES.high * noise]
    none = np.zeros(0, int), np.zeros(0, int), np.zeros(0)
    if not len(able) or not len(border_able):
        return none
    # Places along each edge, so dense that no point so near it is farther from all of them than 1.5 times that.
    near = LEVELS.likely * noise
    places = np.ceil(length[able] / (2 * near)).astype(int) + 1
    of = np.repeat(able, places)
    share = (np.arange(len(of)) - np.repeat(np.cumsum(places) - places, places)) / (places.repeat(places) - 1)
    found = cKDTree(points[border_able]).query_ball_point(start[of] + share[:, None] * along[of], 1.5 * near)
    count = np.array([len(some) for some in found])
    if not count.sum():
        return none
    edge, point = np.unique(
        np.stack([np.repeat(of, count), border_able[np.concatenate([s for s in found if s]).astype(int)]]), axis=1
    )
    arm = points[point] - start[edge]
    share = (arm * along[edge]).sum(1) / length[edge] ** 2
    gap = np.linalg.norm(arm - share[:, None] * along[edge], axis=1)
    inner = np.minimum(share, 1 - share) * length[edge] > near
    beside = (gap < near) & inner & (edges[edge] != point[:, None]).all(1)
    edge, point, share, gap = edge[beside], point[beside], share[beside], gap[beside]
    # A border that only ends at an edge has one point there; one that runs along it has its next point there, too.
    around: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        around.setdefault(a, []).append(b)
        around.setdefault(b, []).append(a)
    pairs = list(zip(edge.tolist(), point.tolist(), strict=True))
    here = set(pairs) | {(e, end) for e in np.unique(edge).tolist() for end in edges[e].tolist()}
    runs = np.fromiter((any((e, next_one) in here for next_one in around[p]) for e, p in pairs), bool, len(pairs))
    edge, point, share, gap = edge[runs], point[runs], share[runs], gap[runs]
    order = np.lexsort((gap, point))
    first = order[np.flatnonzero(np.r_[True, np.diff(point[order]) != 0])] if len(order) else order
    return point[first], edge[first], share[first]
