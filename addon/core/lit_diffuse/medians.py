"""Running estimates of a typical value for each of n elements and three channels.

All share one interface: `add(element, values)` with each element at most once a call, and `result()`. `PSquare` is
the paper's; `Exact` keeps all observations on disk, grouped so that memory stays bounded; `Mean` is what keeps
highlights in.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from ..parallel import ordered_map

QUARTILES = (0.25, 0.5, 0.75)


@dataclass(frozen=True)
class Summary:
    """Typical values of n elements.

    Attributes
    ----------
    median : (n, 3) float32
        Or the mean, for `Mean`. NaN where `count` is 0.
    lower, upper : (n, 3) float32
        Quartiles (for `Mean`: one standard deviation below and above).
    count : (n,) int32
        Observations.
    """

    median: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    count: np.ndarray


class Estimator(Protocol):
    """What accumulation needs of an estimator."""

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        """Take values ((m, 3) float32) of elements ((m,) int32, sorted, each once)."""

    def result(self) -> Summary:
        """The summary of all that was added."""


class Mean:
    """Mean and standard deviation, by Welford's update in float32 means and float32 sums of squares."""

    def __init__(self, count: int):
        self._n = np.zeros(count, np.int32)
        self._mean = np.zeros((count, 3), np.float32)
        self._squares = np.zeros((count, 3), np.float32)

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        self._n[element] += 1
        delta = values - self._mean[element]
        self._mean[element] += delta / self._n[element, None].astype(np.float32)
        self._squares[element] += delta * (values - self._mean[element])

    def result(self) -> Summary:
        deviation = np.sqrt(self._squares / np.maximum(self._n - 1, 1)[:, None])
        mean = np.where(self._n[:, None] > 0, self._mean, np.float32(np.nan))
        return Summary(mean, np.maximum(mean - deviation, 0), mean + deviation, self._n)


class PSquare:
    """P-square (Jain and Chlamtac, CACM 1985) for the median: five markers, constant memory, vectorised.

    The markers stand at the minimum, quartiles and maximum. Desired positions are computed from the count rather
    than incremented: increments drift.
    """

    SHARE = np.float32([0, 0.25, 0.5, 0.75, 1])

    def __init__(self, count: int):
        self._n = np.zeros(count, np.int32)
        self._height = np.zeros((count, 3, 5), np.float32)
        self._position = np.zeros((count, 3, 5), np.float32)  # 1-based ranks, as in the article

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        n = self._n[element]
        starting = n < 5
        for count in range(5):
            new = element[n == count]
            self._height[new, :, count] = values[n == count]
        full = element[n == 4]
        self._height[full] = np.sort(self._height[full], axis=-1)
        self._position[full] = np.arange(1, 6, dtype=np.float32)
        self._n[element] += 1
        if not starting.all():
            self._move(element[~starting], values[~starting])

    def _move(self, element: np.ndarray, x: np.ndarray) -> None:
        q, n = self._height[element], self._position[element]
        q[..., 0] = np.minimum(q[..., 0], x)
        q[..., 4] = np.maximum(q[..., 4], x)
        n[..., 1:4] += x[..., None] < q[..., 1:4]
        n[..., 4] = self._n[element, None]
        desired = 1 + (self._n[element, None, None].astype(np.float32) - 1) * self.SHARE
        for i in (1, 2, 3):
            gap = desired[..., i] - n[..., i]
            right, left = n[..., i + 1] - n[..., i], n[..., i - 1] - n[..., i]
            move = ((gap >= 1) & (right > 1)) | ((gap <= -1) & (left < -1))
            d = np.sign(gap)
            # piecewise-parabolic prediction; eq. (P2) of the article
            rise = (q[..., i + 1] - q[..., i]) / np.where(right == 0, 1, right)
            fall = (q[..., i] - q[..., i - 1]) / np.where(left == 0, 1, -left)
            parabolic = q[..., i] + d / np.maximum(right - left, 1) * ((d - left) * rise + (right - d) * fall)
            linear = q[..., i] + d * np.where(d > 0, rise, fall)
            inside = (q[..., i - 1] < parabolic) & (parabolic < q[..., i + 1])
            q[..., i] = np.where(move, np.where(inside, parabolic, linear), q[..., i])
            n[..., i] += np.where(move, d, 0)
        self._height[element], self._position[element] = q, n

    def result(self) -> Summary:
        height = self._height.copy()
        for count in range(1, 5):  # up to four observations are simply kept: their order statistics are exact
            few = self._n == count
            values = np.sort(height[few, :, :count], axis=-1)
            for marker, share in zip((1, 2, 3), QUARTILES, strict=True):
                height[few, :, marker] = _between(values, share * (count - 1))
        height[self._n == 0] = np.nan
        return Summary(height[..., 2], height[..., 1], height[..., 3], self._n)


def _between(ordered: np.ndarray, rank: float) -> np.ndarray:
    """Linear interpolation in the last axis at a real-valued rank."""
    low = int(np.floor(rank))
    high = min(low + 1, ordered.shape[-1] - 1)
    return ordered[..., low] + np.float32(rank - low) * (ordered[..., high] - ordered[..., low])


class Exact:
    """The exact median and quartiles in bounded memory.

    Observations go to one file for each `BUCKET` elements; at the end each file is sorted by itself. Non-negative
    floats order like their bits, so element and value make one 64-bit key, and one sort gives every order statistic.
    """

    BUCKET = 1 << 16

    def __init__(self, count: int, folder: Path | str | None = None, threads: int = 0):
        self._count = count
        self._threads = threads
        self._folder = tempfile.TemporaryDirectory(dir=folder, prefix="tmp-observations-")
        buckets = range(0, max(count, 1), self.BUCKET)
        self._files = [open(Path(self._folder.name) / f"{start}", "w+b") for start in buckets]  # noqa: SIM115
        self._record = np.dtype([("element", "<u4"), ("value", "<f4", 3)])

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        record = np.empty(len(element), self._record)
        record["element"], record["value"] = element, values
        edges = np.searchsorted(element, np.arange(len(self._files) + 1) * self.BUCKET)
        for file, start, stop in zip(self._files, edges[:-1], edges[1:], strict=True):
            if stop > start:
                file.write(record[start:stop].tobytes())

    def _summarise(self, bucket: int) -> tuple[np.ndarray, np.ndarray]:
        """Quartiles ((k, 3, 3) float32: element, channel, quartile) and counts of one bucket."""
        file = self._files[bucket]
        file.flush()
        record = np.fromfile(file.name, self._record)
        size = min(self.BUCKET, self._count - bucket * self.BUCKET)
        local = (record["element"] - np.uint32(bucket * self.BUCKET)).astype(np.uint64)
        count = np.bincount(local.astype(np.int64), minlength=size)
        start = np.concatenate([[0], np.cumsum(count)[:-1]])
        quartiles = np.full((size, 3, len(QUARTILES)), np.nan, np.float32)
        seen = count > 0
        for channel in range(3):
            bits = np.ascontiguousarray(record["value"][:, channel]).view(np.uint32).astype(np.uint64)
            key = np.sort(local << np.uint64(32) | bits)
            values = (key & np.uint64(0xFFFFFFFF)).astype(np.uint32).view(np.float32)
            for which, share in enumerate(QUARTILES):
                rank = share * (count[seen] - 1)
                low = np.floor(rank).astype(np.int64)
                at = start[seen] + low
                a, b = values[at], values[at + (low + 1 < count[seen])]
                quartiles[seen, channel, which] = a + (rank - low).astype(np.float32) * (b - a)
        return quartiles, count

    def result(self) -> Summary:
        parts = list(ordered_map(self._summarise, range(len(self._files)), self._threads))
        for file in self._files:
            file.close()
        self._folder.cleanup()
        quartiles = np.concatenate([q for q, _ in parts])
        count = np.concatenate([c for _, c in parts]).astype(np.int32)
        return Summary(quartiles[..., 1], quartiles[..., 0], quartiles[..., 2], count)


def make_estimator(name: str, count: int, folder: Path | str | None = None, threads: int = 0) -> Estimator:
    """'exact', 'p2' (the paper's) or 'mean' for `count` elements."""
    if name == "exact":
        return Exact(count, folder, threads)
    return {"p2": PSquare, "mean": Mean}[name](count)
