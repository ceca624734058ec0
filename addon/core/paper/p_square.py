"""P-square, the running median (Haefner et al. 2021, sec. 3.1; Jain and Chlamtac, CACM 1985)."""

from dataclasses import dataclass

import numpy as np

from ..kinds import Unit

QUARTILES: Unit[tuple[float, float, float]] = (0.25, 0.5, 0.75)


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

    @property
    def interquartile_range(self) -> np.ndarray:
        """(n, 3) float32; 0 where `count` is."""
        return np.nan_to_num(self.upper - self.lower)


def between(ordered: np.ndarray, rank: float) -> np.ndarray:
    """Linear interpolation in the last axis at a real-valued rank."""
    low = int(np.floor(rank))
    high = min(low + 1, ordered.shape[-1] - 1)
    return ordered[..., low] + np.float32(rank - low) * (ordered[..., high] - ordered[..., low])


class PSquare:
    """P-square (Jain and Chlamtac, CACM 1985) for the median: five markers, constant memory, vectorised.

    The markers stand at the minimum, quartiles and maximum. Desired positions are computed from the count rather
    than incremented: increments drift.
    """

    SHARE = np.array([0, 0.25, 0.5, 0.75, 1], np.float32)

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
                height[few, :, marker] = between(values, share * (count - 1))
        height[self._n == 0] = np.nan
        return Summary(height[..., 2], height[..., 1], height[..., 3], self._n)

    def close(self) -> None:
        pass
