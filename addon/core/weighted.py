"""Weighted order statistics."""

from collections.abc import Sequence

import numpy as np


def weighted_median(values: np.ndarray, weight: np.ndarray) -> float:
    """The first of the values ((m,)), in rising order, that at least half of the weight ((m,)) does not exceed."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)])


def weighted_quantiles(values: np.ndarray, weight: np.ndarray, shares: Sequence[float]) -> list[np.ndarray]:
    """Quantiles along the last axis; where weights are equal, NumPy's by `method="hazen"`.

    Each value stands in the middle of its weight, and between two of them it goes by a straight line.

    Parameters
    ----------
    values : (..., m)
    weight : (..., m)
        Above 0; broadcast to `values`.

    Returns
    -------
    list of (...)
        For each of the `shares`.
    """
    order, last = np.argsort(values, -1), values.shape[-1] - 1
    values = np.take_along_axis(values, order, -1)
    weight = np.take_along_axis(np.broadcast_to(weight, values.shape), order, -1)
    total = weight.cumsum(-1)
    place = total - weight / 2

    def at(share: float) -> np.ndarray:
        asked = share * total[..., -1:]
        high = np.minimum((place < asked).sum(-1, keepdims=True), last)
        low = np.maximum(high - 1, 0)
        (p, v), (q, w) = ([np.take_along_axis(x, i, -1) for x in (place, values)] for i in (low, high))
        return (v + np.clip((asked - p) / np.where(q > p, q - p, 1), 0, 1) * (w - v))[..., 0]

    return [at(share) for share in shares]
