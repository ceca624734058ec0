"""The exact median: every observation is kept on disk meanwhile."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..paper.p_square import QUARTILES, Summary, between
from ..parallel import ordered_map


class Exact:
    """The exact median and quartiles in bounded memory.

    Observations are held until there are `HELD`, then go to one file, grouped by buckets of `BUCKET` elements; at the
    end each bucket is read and sorted by itself.
    """

    BUCKET = 1 << 14
    HELD = 1 << 22
    RECORD = np.dtype([("element", "<u4"), ("value", "<f4", 3)])

    def __init__(self, count: int, folder: Path | str | None = None, threads: int = 0):
        self._count = count
        self._threads = threads
        self._buckets = max(-(-count // self.BUCKET), 1)
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
        """All observations of one bucket, in the order in which they came."""
        parts = []
        if self._flushed:
            with open(self._path, "rb") as file:
                for start in self._flushed:
                    file.seek(int(start[bucket]) * self.RECORD.itemsize)
                    parts.append(np.fromfile(file, self.RECORD, int(start[bucket + 1] - start[bucket])))
        parts += self._held_of(bucket)
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
        for observations in np.unique(count[count > 0]):
            low, high = np.searchsorted(count, (observations, observations + 1), sorter=by_count)
            same_count = by_count[low:high]
            rows = value[start[same_count, None] + np.arange(observations)].transpose(2, 0, 1).copy()
            rows.sort(axis=-1)
            for quartile, share in enumerate(QUARTILES):
                quartiles[same_count, :, quartile] = between(rows, share * (observations - 1)).T
        return quartiles, count

    def summaries(self) -> Iterator[Summary]:
        """Of all that was added: `BUCKET` elements after another. Once alone: the observations are gone then."""
        sizes = sum((np.diff(starts) for starts in self._flushed), np.zeros(self._buckets, np.int64))
        bucket_bytes = 3 * self.RECORD.itemsize * int(sizes.max(initial=0))  # read, put in order, and its values sorted
        for quartiles, count in ordered_map(self._summarise, range(self._buckets), self._threads, each=bucket_bytes):
            lower, median, upper = np.ascontiguousarray(quartiles.transpose(2, 0, 1))
            yield Summary(median, lower, upper, count.astype(np.int32))
        self.close()

    def result(self) -> Summary:
        parts = list(self.summaries())
        names = ("median", "lower", "upper", "count")
        return Summary(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def close(self) -> None:
        self._held.clear()
        self._folder.cleanup()
