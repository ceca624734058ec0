"""Gather where the light changes, interpolate between: irradiance caching (Ward, Rubinstein and Clear, 1988).

The gathered part of E varies slowly: a value at x_i holds out to a share of the harmonic mean distance R_i of what
surrounds it. The error made at (x, n) is bounded by e_i = |x - x_i| / R_i + sqrt(1 - n . n_i). Points are laid out
coarse to fine: every element whose bound is above `ALLOWED` asks for a new one nearby, half as far apart as before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..parallel import for_blocks, thread_count

ALLOWED = 0.3
"""Error bound (Ward's epsilon) under which an element is interpolated."""
NEIGHBOURS = 8
COARSEST = 0.15
"""First spacing, as a share of the elements' extent (root of the bounding box's largest face)."""
BLOCK = 1 << 15


@dataclass
class _Points:
    position: np.ndarray
    normal: np.ndarray
    value: np.ndarray
    radius: np.ndarray


def _one_per_cell(position: np.ndarray, normal: np.ndarray, spacing: float) -> np.ndarray:
    """Index of one element for each occupied cell of a grid over place and main direction of the normal."""
    cell = np.floor(position / spacing).astype(np.int64)
    cell -= cell.min(0)
    side = np.round(normal * 1.5).astype(np.int64) + 2  # 5 steps an axis: cells of about 40 degrees
    extent = cell.max(0) + 1
    key = ((cell[:, 0] * extent[1] + cell[:, 1]) * extent[2] + cell[:, 2]) * 125
    key += (side[:, 0] * 5 + side[:, 1]) * 5 + side[:, 2]
    # The element nearest the middle of the cell stands for it.
    middle = np.abs(position / spacing - np.floor(position / spacing) - 0.5).sum(1)
    order = np.lexsort((middle, key))
    return order[np.concatenate([[True], np.diff(key[order]) != 0])]


def _bound(points: _Points, index: np.ndarray, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Ward's e_i of each element for each of its neighbours `index` ((n, k)): (n, k) float32."""
    away = points.position[index] - position[:, None]
    distance = np.sqrt(np.einsum("nkj,nkj->nk", away, away))
    turned = np.maximum(1 - np.einsum("nkj,nj->nk", points.normal[index], normal), 0)
    return distance / points.radius[index] + np.sqrt(turned)


def interpolated(
    position: np.ndarray,
    normal: np.ndarray,
    evaluate: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    finest: float,
    threads: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate a smooth quantity at few elements and interpolate it to all.

    Parameters
    ----------
    position, normal : (n, 3) float32
    evaluate : callable
        Takes the indices ((m,) int) of elements, gives the value ((m, c) float32) and the radius R ((m,) float32).
    finest : float
        Least spacing in metres: no two points of one orientation lie closer.

    Returns
    -------
    value : (n, c) float32
    points : (m,) int64
        The elements that were evaluated.
    """
    extent = np.sort(np.ptp(position, axis=0))
    spacing = max(COARSEST * float(np.sqrt(extent[1] * extent[2])), finest)
    todo = np.arange(len(position))
    chosen = np.zeros(0, np.int64)
    points = None
    while len(todo):
        new = todo[_one_per_cell(position[todo], normal[todo], spacing)]
        value, radius = evaluate(new)
        # R is held between the spacing that lies ahead and that of today: a lone close hit must not ask for
        # endless points, nor a large hall for none.
        radius = np.clip(radius, 1.5 * finest / ALLOWED, 2 * spacing / ALLOWED)
        batch = _Points(position[new], normal[new], value, radius)
        points = batch if points is None else _Points(
            *(np.concatenate([getattr(points, f), getattr(batch, f)]) for f in ("position", "normal", "value", "radius"))
        )  # fmt: skip
        chosen = np.concatenate([chosen, new])
        if spacing <= finest:
            break
        spacing = max(spacing / 2, finest)
        # Distance in place and in orientation as one space: a turn by 40 degrees counts like one spacing.
        tree = cKDTree(np.concatenate([points.position / spacing, points.normal * 1.5], 1))
        covered = np.zeros(len(todo), bool)

        def check(part: slice, todo=todo, tree=tree, points=points, spacing=spacing, covered=covered) -> None:
            p, n = position[todo[part]], normal[todo[part]]
            k = min(4, len(points.radius))
            _, index = tree.query(np.concatenate([p / spacing, n * 1.5], 1), k=k)
            covered[part] = _bound(points, index.reshape(len(p), k), p, n).min(1) <= ALLOWED

        for_blocks(check, len(todo), BLOCK, threads)
        todo = todo[~covered]
    return _spread(points, position, normal, threads), chosen


def _spread(points: _Points, position: np.ndarray, normal: np.ndarray, threads: int) -> np.ndarray:
    """Weighted mean of the nearest points for every element; weights fall to 0 at twice the allowed error."""
    scale = float(np.median(points.radius)) * ALLOWED
    tree = cKDTree(np.concatenate([points.position / scale, points.normal * 1.5], 1))
    result = np.empty((len(position), points.value.shape[1]), np.float32)
    k = min(NEIGHBOURS, len(points.radius))

    def fill(part: slice) -> None:
        p, n = position[part], normal[part]
        _, index = tree.query(np.concatenate([p / scale, n * 1.5], 1), k=k)
        index = index.reshape(len(p), k)
        bound = _bound(points, index, p, n)
        weight = np.maximum(1 - bound / (2 * ALLOWED), 0) ** 2
        # Where nothing is near enough, the best of what there is.
        lost = weight.sum(1) <= 1e-6
        weight[lost, bound[lost].argmin(1)] = 1
        weight /= weight.sum(1, keepdims=True)
        result[part] = np.einsum("nk,nkc->nc", weight.astype(np.float32), points.value[index])

    for_blocks(fill, len(position), BLOCK, thread_count(threads))
    return result
