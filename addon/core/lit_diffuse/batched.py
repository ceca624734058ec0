"""The median in constant memory: exact for an element's first observations, a fixed number of knots beyond.

Each element has `SLOTS` places a channel. While its observations fit, they are simply kept. From then on `KNOTS`
places hold knots of its quantile function, and the other `BATCH` take new observations; whenever those are full, all
are sorted and the knots taken anew. The knots' ranks depend on the count alone, so they need no place. They stand at
consecutive ranks around the median and ever wider apart towards the ends: in random order the median moves by a rank
or two from batch to batch, and there the knots are observations, not interpolated. So it stays close to exact for
thousands of observations (Munro and Paterson, Selection and sorting with limited storage, 1980, have the idea; the
spacing is that of a merging digest, Dunning and Ertl 2019). In sorted order the median walks into the wide gaps; what
is lost then docs/speed-against-error.md shows.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from ..kinds import Block, Code
from ..paper.p_square import QUARTILES, Summary
from ..parallel import blocks, ordered_map
from .params import MEDIANS
from .sorting import sort_planes

SLOTS, KNOTS = MEDIANS.slots, MEDIANS.knots
BATCH = SLOTS - KNOTS
SLOT_BITS: Code[int] = 5
AT_ONCE: Block[int] = 1 << 14
RENEWED_AT_ONCE: Block[int] = 1 << 11
"""Elements summarised, and such whose knots are taken, at once: their places fit the processor's cache."""


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
def _shares(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Ranks that each place covers in all, and those below its value, with `count` observations: (SLOTS,) each.

    A knot covers half of the gap on either side, an observation covers one rank.
    """
    cover, below = np.ones(SLOTS), np.full(SLOTS, 0.5)
    if count > SLOTS:
        half = np.concatenate([[0.5], np.diff(knot_ranks(count - _fresh(count))) / 2, [0.5]])
        cover[:KNOTS], below[:KNOTS] = half[:-1] + half[1:], half[:-1]
    return cover, below


def _fresh(count):
    """Observations beside the knots once there are `count` > SLOTS of them: 1 to BATCH."""
    return (count - SLOTS - 1) % BATCH + 1


@functools.cache
def _places(most: int) -> np.ndarray:
    """The place that the next observation takes, for each count up to `most`: (most + 1,) int64."""
    count = np.arange(most + 1)
    return np.where(count < SLOTS, count, KNOTS + (count - SLOTS) % BATCH)


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
        most = int(n.max(initial=0))
        at = _places(most).take(n)
        if most >= SLOTS:
            due = np.flatnonzero((at == KNOTS) & (n >= SLOTS))
            self._renew(element.take(due), n.take(due))
        at *= len(self._n)
        at += element
        # Three floats as one item: a third of the time of three columns.
        self._held.reshape(-1).view("V12")[at] = np.ascontiguousarray(values, np.float32).reshape(-1).view("V12")
        n += 1
        self._n[element] = n

    def _renew(self, element: np.ndarray, n: np.ndarray) -> None:
        """Take the knots of elements whose places are full; n: (m,) their counts."""
        for block in blocks(len(element), RENEWED_AT_ONCE):
            some, counts = element[block], n[block]
            keys, ranks = self._sorted(some, counts)
            knots = np.rint(_at_ranks(ranks, keys, _by_count(knot_ranks, counts))).astype(np.int32)
            knots = np.ascontiguousarray(knots.reshape(len(some), 3, KNOTS).transpose(2, 0, 1)).view("V12")[..., 0]
            self._held.view("V12")[:KNOTS, some, 0] = knots

    def _sorted(self, element: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sorted keys and their ranks, (3 m, SLOTS) float64 each, of m elements with `n` >= SLOTS observations.

        A key is a float's bits: for numbers from 0 on they have the numbers' order, and a straight line between two
        of them is nearly a straight line between the logarithms, which six decades ask for. Free places come last.
        """
        held = self._held.view("V12")[..., 0].take(element, 1).view(np.float32).reshape(SLOTS, len(element), 3)
        keys = held.view(np.int32).transpose(1, 2, 0).astype(np.int64)
        np.maximum(keys, 0, out=keys)  # -0.0 becomes 0.0
        free = np.arange(SLOTS) >= np.where(n > SLOTS, KNOTS + _fresh(n), SLOTS)[:, None]
        if free.any():
            np.copyto(keys, np.iinfo(np.int32).max, where=free[:, None])
        # The place rides along in the low bits: one sort instead of an argsort and two gathers.
        keys <<= SLOT_BITS
        keys |= np.arange(SLOTS)
        keys = keys.reshape(-1, SLOTS)
        keys.sort(axis=1)
        place = keys & ((1 << SLOT_BITS) - 1)
        place += (np.repeat(np.arange(len(n)), 3) * SLOTS)[:, None]
        cover = _by_count(lambda count: _shares(count)[0], n).take(place)
        below = _by_count(lambda count: _shares(count)[1], n).take(place)
        ranks = np.cumsum(cover, axis=1)
        ranks -= cover
        ranks += below
        ranks -= 0.5
        keys >>= SLOT_BITS
        return keys.astype(np.float64), ranks

    def _summarise(self, block: slice) -> np.ndarray:
        """Quartiles of a block of elements, (quartile, k, 3) float32."""
        n = self._n[block]
        result = np.full((len(QUARTILES), len(n), 3), np.nan, np.float32)
        if not n.any():
            return result
        few = np.flatnonzero((n > 0) & (n <= SLOTS))
        most = int(n.take(few).max(initial=0))
        planes = self._held[:most, block].copy()
        for place, plane in enumerate(planes.view("V12")[..., 0]):
            plane[n <= place] = np.full(3, np.inf, np.float32).view("V12")[0]
        sort_planes(planes.reshape(most, 3 * len(n)))
        rows = planes.reshape(-1, 3)
        for quartile, share in zip(result, QUARTILES):
            rank = share * (n[few] - 1)
            low = rank.astype(np.int64)
            rest = (rank - low).astype(np.float32)[:, None]
            lower = rows.take(low * len(n) + few, 0)
            upper = rows.take(np.minimum(low + 1, n[few] - 1) * len(n) + few, 0)
            quartile[few] = lower + rest * (upper - lower)
        beyond = np.flatnonzero(n > SLOTS)
        for part in blocks(len(beyond), RENEWED_AT_ONCE):
            many = beyond[part]
            keys, ranks = self._sorted(many + block.start, n[many])
            # Between two observations the median is their mean, not that of their logarithms.
            values = keys.astype(np.int32).view(np.float32)
            found = _at_ranks(ranks, values, (n[many, None] - 1) * np.array(QUARTILES))
            result[:, many] = found.reshape(len(many), 3, -1).transpose(2, 0, 1)
        return result

    def result(self) -> Summary:
        parts = list(ordered_map(self._summarise, blocks(len(self._n), AT_ONCE), self._threads))
        lower, median, upper = np.concatenate([np.zeros((len(QUARTILES), 0, 3), np.float32), *parts], 1)
        return Summary(median, lower, upper, self._n)

    def close(self) -> None:
        pass


def _by_count(table: Callable[[int], np.ndarray], n: np.ndarray) -> np.ndarray:
    """`table(count)` for each of the counts `n` ((m,)): (m, k)."""
    counts, which = np.unique(n, return_inverse=True)
    return np.stack([table(int(count)) for count in counts])[which]


def _at_ranks(ranks: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Values at ranks `wanted`, linear in between, for each element's three channels.

    Parameters
    ----------
    ranks, values : (3 m, k)
    wanted : (m, w)

    Returns
    -------
    (3 m, w) float64
    """
    # All rows on one axis, one after the other: one call for all.
    row = np.arange(len(ranks), dtype=np.float64)[:, None] * (ranks.max() + 2)
    wanted = np.repeat(wanted, 3, axis=0)
    return np.interp((row + wanted).ravel(), (row + ranks).ravel(), values.ravel()).reshape(wanted.shape)
