"""Running estimates of a typical value for each of n elements and three channels, by name.

Measured against one another: `scan-relight benchmark lit_diffuse`.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

import numpy as np

from ..paper.p_square import PSquare, Summary
from .exact import Exact


class Estimator(Protocol):
    """What accumulation needs of an estimator."""

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        """Take values ((m, 3) float32) of elements ((m,) int32, sorted, each once)."""

    def result(self) -> Summary:
        """The summary of all that was added."""

    def close(self) -> None:
        """Take back what was written to disk. May be called more than once."""


class Mean:
    """Mean and standard deviation, which keep highlights in, by Welford's update in float32."""

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


def make_estimator(name: str, count: int, folder: Path | str | None = None, threads: int = 0) -> Estimator:
    """'exact', 'p2' (the paper's) or 'mean' for `count` elements; `folder` takes what 'exact' writes to disk."""
    make: dict[str, Callable[[], Estimator]] = {
        "exact": lambda: Exact(count, folder, threads),
        "p2": lambda: PSquare(count),
        "mean": lambda: Mean(count),
    }
    return make[name]()


def summaries(estimator: Estimator) -> Iterator[Summary]:
    """What an estimator's `result` is, by blocks of elements where it can."""
    return estimator.summaries() if isinstance(estimator, Exact) else iter([estimator.result()])
