"""Sorting many short columns at once, by a network of comparisons over whole planes."""

from __future__ import annotations

import functools

import numpy as np


@functools.cache
def comparators(count: int) -> tuple[tuple[int, int], ...]:
    """Batcher's odd-even merge sort for `count` inputs: pairs (i, j), i < j, to be put in order one after the other.

    Batcher, Sorting networks and their applications, AFIPS 1968; for any count as Knuth gives it, vol. 3, 5.2.2 M.
    """
    pairs = []
    top = 1 << max((count - 1).bit_length() - 1, 0)
    p = top
    while p > 0:
        q, r, d = top, 0, p
        while True:
            pairs += [(i, i + d) for i in range(count - d) if i & p == r]
            if q == p:
                break
            d, q, r = q - p, q >> 1, p
        p >>= 1
    return tuple(pairs)


def sort_planes(planes: np.ndarray) -> None:
    """Sort (k, m) float32 in place along the first axis, no NaN: for k up to about 30, several times faster than
    `np.sort`, which sees m short rows one by one.
    """
    if len(planes) < 2:
        return
    smaller = np.empty_like(planes[0])
    for i, j in comparators(len(planes)):
        np.minimum(planes[i], planes[j], out=smaller)
        np.maximum(planes[i], planes[j], out=planes[j])
        planes[i] = smaller
