"""The mean: what keeps highlights in, for comparison."""

import numpy as np

from ..paper.p_square import Summary


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
