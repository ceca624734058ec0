"""What accumulation needs of an estimator of typical values."""

from typing import Protocol

import numpy as np

from ..paper.p_square import Summary


class Estimator(Protocol):
    """What accumulation needs of an estimator."""

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        """Take values ((m, 3) float32) of elements ((m,) int32, sorted, each once)."""

    def result(self) -> Summary:
        """The summary of all that was added."""

    def close(self) -> None:
        """Take back what was written to disk. May be called more than once."""
