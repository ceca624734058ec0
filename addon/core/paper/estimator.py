"""What accumulation needs of an estimator of typical values, and what it gets from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

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


def between(ordered: np.ndarray, rank: float) -> np.ndarray:
    """Linear interpolation in the last axis at a real-valued rank."""
    low = int(np.floor(rank))
    high = min(low + 1, ordered.shape[-1] - 1)
    return ordered[..., low] + np.float32(rank - low) * (ordered[..., high] - ordered[..., low])
