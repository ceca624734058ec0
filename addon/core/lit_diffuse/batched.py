"""The default median: exact for an element's first observations, a fixed number of knots beyond. Constant memory.

Each element has `SLOTS` places a channel. While its observations fit, they are simply kept. From then on `KNOTS`
places hold knots of its quantile function, and the other `BATCH` take new observations; whenever those are full, all
are sorted and the knots taken anew. The knots' ranks depend on the count alone, so they need no place. They stand at
consecutive ranks around the median and ever wider apart towards the ends: in random order the median moves by a rank
or two from batch to batch, and there the knots are observations, not interpolated. So it stays close to exact for
thousands of observations (Munro and Paterson, Selection and sorting with limited storage, 1980, have the idea; the
spacing is that of a merging digest, Dunning and Ertl 2019). In sorted order the median walks into the wide gaps; what
is lost then the benchmark `medians` shows.
"""

from __future__ import annotations

import functools

import numpy as np

from ..parallel import blocks, ordered_map
from .estimator import QUARTILES, Summary
from .sorting import sort_planes

SLOTS, KNOTS = 20, 12
BATCH = SLOTS - KNOTS
SLOT_BITS = 5
AT_ONCE = 1 << 14
"""Elements summarised at once: their places fit the processor's cache."""


@functools.cache
def knot_ranks(count: int) -> np.ndarray:
    """Ranks (0-based, (KNOTS,) float64) at which the knots of `count` observations stand: symmetric, ends included.

    Distances from the median's rank grow geometrically, from half a rank to a quarter of all; then the end.
    """
    inner = KNOTS // 2 - 2
    away = np.maximum(0.5 * (count / 2) ** (np.arange(inner) / inner), 0.5 + np.arange(inner))
    # On whole ranks, where a knot is an observation: those of an even count lie half a rank off the median's.
    away = np.floor(away) + 0.5 if count % 2 == 0 else np.round(away) * (np.arange(inner) > 0)
    away = np.concatenate([away, [(count - 1) / 4, (count - 1) / 2]])
    return (count - 1) / 2 + np.concatenate([-away[::-1], away])


@functools.cache
def _shares(count: int, batch: int) -> tuple[np.ndarray, np.ndarray]:
    """Ranks that each place covers in all, and those below its value: knots of `count`, and `batch` more observations.

    A knot covers half of the gap on either side, an observation covers one rank.
    """
    half = np.concatenate([[0.5], np.diff(knot_ranks(count)) / 2, [0.5]])
    ones = np.ones(batch)
    return np.concatenate([half[:-1] + half[1:], ones]), np.concatenate([half[:-1], ones / 2])


class Batched:
    """Exact up to `SLOTS` observations, knots beyond; 12 * `SLOTS` + 4 bytes an element.

    Memory of places that no element needs is never touched, so that rare tiers cost little.
    """

    def __init__(self, count: int, threads: int = 0):
        self._n = np.zeros(count, np.int32)
        self._held = np.empty((SLOTS, count, 3), np.float32)  # plane by plane: neighbours are written together
        self._threads = threads

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        n = self._n.take(element)
        slot = n
        if n.max(initial=0) >= SLOTS:
            beyond = (n - SLOTS) % BATCH
            due = (n >= SLOTS) & (beyond == 0)
            self._renew(element[due], n[due])
            slot = np.where(n < SLOTS, n, KNOTS + beyond)
        at = slot * np.int64(len(self._n))
        at += element
        # Three floats as one item: a third of the time of three columns.
        self._held.reshape(-1).view("V12")[at] = np.ascontiguousarray(values, np.float32).reshape(-1).view("V12")
        self._n[element] = n + 1

    def _renew(self, element: np.ndarray, n: np.ndarray) -> None:
        """Take the knots of elements whose places are full; n: (m,) their counts."""
        for count in np.unique(n):
            alike = element[n == count]
            keys, ranks = self._sorted(alike, int(count), SLOTS)
            knots = np.rint(_at_ranks(ranks, keys, knot_ranks(int(count)))).astype(np.int32).view(np.float32)
            self._held[:KNOTS, alike] = knots.reshape(len(alike), 3, KNOTS).transpose(2, 0, 1)

    def _sorted(self, element: np.ndarray, count: int, used: int) -> tuple[np.ndarray, np.ndarray]:
        """Sorted keys and their ranks, (3 m, used) float64 each, of elements with `count` observations.

        A key is a float's bits: for numbers from 0 on they have the numbers' order, and a straight line between two
        of them is nearly a straight line between the logarithms, which six decades ask for.
        """
        held = self._held[:used, element].transpose(1, 2, 0).reshape(-1, used)
        keys = np.maximum(np.ascontiguousarray(held).view(np.int32), 0).astype(np.int64)  # -0.0 becomes 0.0
        # The place rides along in the low bits: one sort instead of an argsort and two gathers.
        keys = np.sort(keys << SLOT_BITS | np.arange(used), axis=1)
        place = keys & ((1 << SLOT_BITS) - 1)
        if count > SLOTS:
            cover, below = _shares(count - (used - KNOTS), used - KNOTS)
            ranks = np.cumsum(cover[place], axis=1)
            ranks += (below - cover)[place] - 0.5
        else:  # all are observations still
            ranks = np.broadcast_to(np.arange(used, dtype=np.float64), keys.shape)
        return (keys >> SLOT_BITS).astype(np.float64), ranks

    def _summarise(self, block: slice) -> np.ndarray:
        """Quartiles of a block of elements, (quartile, k, 3) float32."""
        n = self._n[block]
        result = np.full((len(QUARTILES), len(n), 3), np.nan, np.float32)
        if not n.any():
            return result
        most = min(int(n.max()), SLOTS)
        few = np.flatnonzero((n > 0) & (n <= SLOTS))
        planes = np.where(np.arange(most)[:, None, None] < n[:, None], self._held[:most, block], np.float32(np.inf))
        sort_planes(planes.reshape(most, -1))
        rows = planes.reshape(-1, 3)
        for quartile, share in zip(result, QUARTILES):
            rank = share * (n[few] - 1)
            low = rank.astype(np.int64)
            part = (rank - low).astype(np.float32)[:, None]
            lower = rows.take(low * len(n) + few, 0)
            upper = rows.take(np.minimum(low + 1, n[few] - 1) * len(n) + few, 0)
            quartile[few] = lower + part * (upper - lower)
        for count in np.unique(n[n > SLOTS]):
            alike = np.flatnonzero(n == count)
            used = KNOTS + (int(count) - SLOTS - 1) % BATCH + 1
            keys, ranks = self._sorted(alike + block.start, int(count), used)
            # Between two observations the median is their mean, not that of their logarithms.
            values = keys.astype(np.int32).view(np.float32)
            wanted = np.array(QUARTILES) * (int(count) - 1)
            result[:, alike] = _at_ranks(ranks, values, wanted).reshape(len(alike), 3, -1).transpose(2, 0, 1)
        return result

    def result(self) -> Summary:
        parts = list(ordered_map(self._summarise, blocks(len(self._n), AT_ONCE), self._threads))
        lower, median, upper = np.concatenate([np.zeros((len(QUARTILES), 0, 3), np.float32), *parts], 1)
        return Summary(median, lower, upper, self._n)

    def close(self) -> None:
        pass


def _at_ranks(ranks: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Each row's value at ranks `wanted` ((w,)), linear in between: (m, w) float64; ranks and values: (m, k)."""
    # All rows on one axis, one after the other: one call for all.
    row = np.arange(len(ranks), dtype=np.float64)[:, None] * (ranks.max(initial=0) + wanted.max(initial=0) + 2)
    return np.interp((row + wanted).ravel(), (row + ranks).ravel(), values.ravel()).reshape(len(ranks), len(wanted))
