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

    def close(self) -> None:
        """Take back what was written to disk. May be called more than once."""


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

    def close(self) -> None:
        pass


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

    def close(self) -> None:
        pass


def _between(ordered: np.ndarray, rank: float) -> np.ndarray:
    """Linear interpolation in the last axis at a real-valued rank."""
    low = int(np.floor(rank))
    high = min(low + 1, ordered.shape[-1] - 1)
    return ordered[..., low] + np.float32(rank - low) * (ordered[..., high] - ordered[..., low])


class Exact:
    """The exact median and quartiles in bounded memory.

    Observations are held until there are `HELD`, then go to one file, grouped by buckets of `BUCKET` elements; at the
    end each bucket is read and sorted by itself.
    """

    BUCKET = 1 << 16
    HELD = 1 << 22
    RECORD = np.dtype([("element", "<u4"), ("value", "<f4", 3)])

    def __init__(self, count: int, folder: Path | str | None = None, threads: int = 0):
        self._count = count
        self._threads = threads
        self._buckets = -(-count // self.BUCKET)
        self._folder = tempfile.TemporaryDirectory(dir=folder, prefix="tmp-observations-")
        self._path = Path(self._folder.name) / "observations"
        self._held: list[tuple[np.ndarray, np.ndarray]] = []  # records, and where each bucket starts in them
        self._flushed: list[np.ndarray] = []  # for each flush where each bucket starts in the file, in records

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        if not len(element):
            return
        record = np.empty(len(element), self.RECORD)
        record["element"], record["value"] = element, values
        self._held.append((record, np.searchsorted(element, np.arange(self._buckets + 1) * self.BUCKET)))
        if sum(len(held) for held, _ in self._held) >= self.HELD:
            self._flush()

    def _flush(self) -> None:
        starts = [self._flushed[-1][-1] if self._flushed else 0]
        with open(self._path, "ab") as file:
            for bucket in range(self._buckets):
                parts = self._held_of(bucket)
                for part in parts:
                    part.tofile(file)
                starts.append(starts[-1] + sum(map(len, parts)))
        self._flushed.append(np.array(starts, np.int64))
        self._held.clear()

    def _held_of(self, bucket: int) -> list[np.ndarray]:
        return [record[start[bucket] : start[bucket + 1]] for record, start in self._held]

    def _records(self, bucket: int) -> np.ndarray:
        """All observations of one bucket."""
        parts = self._held_of(bucket)
        if self._flushed:
            with open(self._path, "rb") as file:
                for start in self._flushed:
                    file.seek(int(start[bucket]) * self.RECORD.itemsize)
                    parts.append(np.fromfile(file, self.RECORD, int(start[bucket + 1] - start[bucket])))
        return np.concatenate(parts) if parts else np.zeros(0, self.RECORD)

    def _summarise(self, bucket: int) -> tuple[np.ndarray, np.ndarray]:
        """Quartiles ((k, 3, 3) float32: element, channel, quartile) and counts of one bucket."""
        record = self._records(bucket)
        size = min(self.BUCKET, self._count - bucket * self.BUCKET)
        local = (record["element"] - np.uint32(bucket * self.BUCKET)).astype(np.uint16)  # BUCKET fits: a radix sort
        value = record["value"][np.argsort(local, kind="stable")]
        count = np.bincount(local, minlength=size)
        start = np.cumsum(count) - count
        quartiles = np.full((size, 3, len(QUARTILES)), np.nan, np.float32)
        # Elements with equally many observations make one array, whose rows are sorted at once.
        by_count = np.argsort(count, kind="stable")
        for seen in np.unique(count[count > 0]):
            low, high = np.searchsorted(count, (seen, seen + 1), sorter=by_count)
            alike = by_count[low:high]
            rows = value[start[alike, None] + np.arange(seen)].transpose(2, 0, 1).copy()
            rows.sort(axis=-1)
            for which, share in enumerate(QUARTILES):
                quartiles[alike, :, which] = _between(rows, share * (seen - 1)).T
        return quartiles, count

    def result(self) -> Summary:
        parts = list(ordered_map(self._summarise, range(self._buckets), self._threads))
        self.close()
        quartiles = np.concatenate([np.zeros((0, 3, 3), np.float32)] + [q for q, _ in parts])
        count = np.concatenate([np.zeros(0, np.int64)] + [c for _, c in parts]).astype(np.int32)
        return Summary(quartiles[..., 1], quartiles[..., 0], quartiles[..., 2], count)

    def close(self) -> None:
        self._held.clear()
        self._folder.cleanup()


def make_estimator(name: str, count: int, folder: Path | str | None = None, threads: int = 0) -> Estimator:
    """'exact', 'p2' (the paper's) or 'mean' for `count` elements."""
    if name == "exact":
        return Exact(count, folder, threads)
    return {"p2": PSquare, "mean": Mean}[name](count)
