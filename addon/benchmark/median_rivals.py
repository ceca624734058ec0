"""Running medians that the product does not offer, for comparison."""

from __future__ import annotations

import numpy as np

from ..core.paper.p_square import QUARTILES, PSquare, Summary, between

DARKEST, BRIGHTEST = 1e-6, 1e4
"""Range of the logarithms; what is darker counts as darkest."""


class LogPSquare(PSquare):
    """P-square over logarithms, whose markers start from the first 15 observations instead of 5."""

    START = 15

    def __init__(self, count: int):
        super().__init__(count)
        self._first = np.empty((self.START, count, 3), np.float32)

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        """As `PSquare.add`."""
        x, n = np.log(np.maximum(values, np.float32(DARKEST))), self._n[element]
        new = n < self.START
        self._first[n[new], element[new]] = x[new]
        self._n[element] += 1
        full = element[n == self.START - 1]
        self._height[full] = np.sort(self._first[:, full], axis=0)[[0, 3, 7, 11, 14]].transpose(1, 2, 0)
        self._position[full] = np.float32([1, 4, 8, 12, 15])
        if not new.all():
            self._move(element[~new], x[~new])

    def result(self) -> Summary:
        """As `PSquare.result`."""
        found = self._height[..., 1:4].copy()
        for count in range(1, self.START):
            few = self._n == count
            ordered = np.sort(self._first[:count, few], axis=0).transpose(1, 2, 0)
            found[few] = np.stack([between(ordered, share * (count - 1)) for share in QUARTILES], -1)
        found[self._n == 0] = np.nan
        lower, median, upper = np.moveaxis(np.exp(found), -1, 0)
        return Summary(median, lower, upper, self._n)


class TwoPasses:
    """Two counting passes: 32 bins over all logarithms, then 32 over the bin that the median is in.

    All frames are seen twice. `turn` begins the second pass.
    """

    BINS = 32

    def __init__(self, count: int):
        self._n = np.zeros(count, np.int32)
        self._bins = np.zeros((count * 3, self.BINS), np.uint16)
        self._low = np.full((count, 3), np.log(DARKEST), np.float32)
        self._width = np.float32(np.log(BRIGHTEST / DARKEST) / self.BINS)
        self._below = np.zeros((count, 3), np.int32)
        self._second = False

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        """Count values of elements; in the second pass, those in the median's bin."""
        x = (np.log(np.maximum(values, np.float32(DARKEST))) - self._low[element]) / self._width
        at = np.floor(x).astype(np.int32)
        row = element[:, None] * 3 + np.arange(3)
        if self._second:
            inside = (at >= 0) & (at < self.BINS)
            self._bins[row[inside], at[inside]] += 1
        else:
            self._bins[row, np.clip(at, 0, self.BINS - 1)] += 1
            self._n[element] += 1

    def _at_median(self) -> tuple[np.ndarray, np.ndarray]:
        """The bin of the median ((count, 3)) and where in it, 0 to 1."""
        counts = self._bins.reshape(*self._low.shape, self.BINS)
        until = np.cumsum(counts, -1)
        wanted = (self._n[:, None] / 2 - self._below)[..., None]
        at = np.minimum((until < wanted).sum(-1), self.BINS - 1)
        own = np.take_along_axis(counts, at[..., None], -1)
        before = np.take_along_axis(until, at[..., None], -1) - own
        return at, ((wanted - before) / np.maximum(own, 1))[..., 0]

    def turn(self) -> None:
        """Narrow the range to the median's bin."""
        at, _ = self._at_median()
        until = np.cumsum(self._bins.reshape(*self._low.shape, self.BINS), -1)
        self._below = np.where(at > 0, np.take_along_axis(until, np.maximum(at - 1, 0)[..., None], -1)[..., 0], 0)
        self._low += at * self._width
        self._width /= self.BINS
        self._bins[:] = 0
        self._second = True

    def result(self) -> Summary:
        """The median; quartiles are not counted."""
        at, part = self._at_median()
        median = np.exp(self._low + (at + np.clip(part, 0, 1)) * self._width).astype(np.float32)
        median = np.where(self._n[:, None] > 0, median, np.float32(np.nan))
        return Summary(median, median, median, self._n)

    def close(self) -> None:
        """Nothing to take back."""
