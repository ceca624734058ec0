"""Triangles that overlap in texture space, and the layers that set them apart.

A projection folds where a surface does: two sheets of one island come to lie on each other, and a texel would stand
for two places. Pure numpy; texture space only.
"""

import numpy as np

from ..kinds import Block

_LEVELS: Block[int] = 12
_CANDIDATES_AT_ONCE: Block[int] = 1_500_000


def overlapping_pairs(uv: np.ndarray, depth: float, island: np.ndarray | None = None) -> np.ndarray:
    """Pairs of triangles that penetrate each other.

    A hierarchy of grids holds each triangle at the level whose cells are at least its size, so that it lies in at
    most four cells; each triangle is then looked up at its own level and at all coarser ones.

    Parameters
    ----------
    uv : (t, 3, 2) float
        Corners, in [0, 1].
    depth : float
        Penetration, in units of `uv`, that still counts as touching. Triangles thinner than this never overlap.
    island : (t,) int, optional
        Only pairs of one island are looked for; without it all pairs are.

    Returns
    -------
    pairs : (p, 2) int64
        Without repetition, the smaller index first.
    """
    low, high = uv.min(1), uv.max(1)
    extent = np.maximum((high - low).max(1), 2.0**-_LEVELS)
    level = np.clip(np.floor(-np.log2(extent)), 0, _LEVELS).astype(np.int64)
    group = np.zeros(len(uv), np.int64) if island is None else island.astype(np.int64)
    candidates = np.arange(len(uv))
    if island is not None:
        candidates = candidates[np.bincount(group)[group] > 1]
    penetrating = [np.empty((0, 2), np.int64)]
    for coarse in np.unique(level[candidates]):
        owners = candidates[level[candidates] == coarse]
        queries = candidates[level[candidates] >= coarse]
        key, owner = _cells(low, high, group, owners, int(coarse))
        order = np.argsort(key, kind="stable")
        key, owner = key[order], owner[order]
        query_key, query_owner = _cells(low, high, group, queries, int(coarse))
        first, last = np.searchsorted(key, query_key, "left"), np.searchsorted(key, query_key, "right")
        for a, b in _joined(query_owner, owner, first, last):
            # Of two at one level each finds the other; of two levels only the finer one asks.
            keep = (a < b) | (level[a] != level[b])
            a, b = a[keep], b[keep]
            penetrating.append(_penetrating(uv, low, high, a, b, depth))
    pairs = np.concatenate(penetrating)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def layers(pairs: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Give overlapping triangles layers, so that no two in one layer overlap.

    The higher triangle of a pair stays as long as nothing above it does: whole sheets of a fold keep together.

    Parameters
    ----------
    pairs : (p, 2) int64
    height : (t,) float
        Position along the projection.

    Returns
    -------
    layer : (t,) int64
        0 for all triangles without overlap.
    """
    layer = np.zeros(len(height), np.int64)
    rank = np.argsort(np.argsort(height, kind="stable"))
    number = 0
    while len(pairs):
        undecided = np.zeros(len(height), bool)
        undecided[pairs] = True
        later = np.zeros(len(height), bool)
        while undecided.any():
            open_pairs = pairs[undecided[pairs].all(1)]
            lower = np.where(rank[open_pairs[:, 0]] < rank[open_pairs[:, 1]], open_pairs[:, 0], open_pairs[:, 1])
            stays = undecided.copy()
            stays[lower] = False
            beaten = pairs[stays[pairs].any(1)].ravel()
            beaten = beaten[undecided[beaten] & ~stays[beaten]]
            later[beaten] = True
            undecided[beaten] = False
            undecided[stays] = False
        number += 1
        layer[later] = number
        pairs = pairs[later[pairs].all(1)]
    return layer


def _cells(low, high, group, triangles, level):
    """Keys of the up to four cells that each triangle's box touches, with the triangle of each."""
    count = 1 << level
    first = np.clip((low[triangles] * count).astype(np.int64), 0, count - 1)
    last = np.clip((high[triangles] * count).astype(np.int64), 0, count - 1)
    keys, owners = [], []
    for x in (0, 1):
        for y in (0, 1):
            inside = (first[:, 0] + x <= last[:, 0]) & (first[:, 1] + y <= last[:, 1])
            touching = triangles[inside]
            keys.append((group[touching] * count + first[inside, 0] + x) * count + first[inside, 1] + y)
            owners.append(touching)
    return np.concatenate(keys), np.concatenate(owners)


def _joined(query, owner, first, last):
    """All (asker, owner) of equal cells, in blocks that fit in memory."""
    counts = last - first
    block = np.searchsorted(np.cumsum(counts), np.arange(0, counts.sum() + 1, _CANDIDATES_AT_ONCE)[1:], "right")
    edges = np.unique(np.concatenate([[0], block, [len(counts)]]))
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        n = counts[start:stop]
        offset = np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n)
        yield np.repeat(query[start:stop], n), owner[np.repeat(first[start:stop], n) + offset]


def _penetrating(uv, low, high, a, b, depth):
    """Of the pairs (a, b) those that no edge's normal separates, (p, 2) int64."""
    boxes = (np.minimum(high[a], high[b]) - np.maximum(low[a], low[b]) > depth).all(1)
    a, b = a[boxes], b[boxes]
    for edge in range(6):
        source = a if edge < 3 else b
        p, q = uv[source, edge % 3].astype(np.float64), uv[source, (edge + 1) % 3].astype(np.float64)
        normal = np.stack([p[:, 1] - q[:, 1], q[:, 0] - p[:, 0]], -1)
        length = np.linalg.norm(normal, axis=1)
        # An edge without length has no normal to separate with; the other edges decide.
        normal /= np.where(length > 0, length, 1)[:, None]
        along_a = ((uv[a] - p[:, None]) * normal[:, None]).sum(-1)
        along_b = ((uv[b] - p[:, None]) * normal[:, None]).sum(-1)
        shared = np.minimum(along_a.max(1), along_b.max(1)) - np.maximum(along_a.min(1), along_b.min(1))
        keep = (shared > depth) | (length == 0)
        a, b = a[keep], b[keep]
    return np.stack([a, b], -1)
