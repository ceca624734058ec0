"""Weighted order statistics."""

from collections.abc import Sequence

import numpy as np

from .kinds import Unit

ROUNDING: Unit[float] = 1e-10


def weighted_median(values: np.ndarray, weight: np.ndarray) -> float:
    """The first of the values ((m,)), in rising order, that at least half of the weight ((m,)) does not exceed."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)])


def weighted_quantiles(values: np.ndarray, weight: np.ndarray, shares: Sequence[float]) -> list[np.ndarray]:
    """Quantiles along the last axis; where weights are equal, NumPy's by `method="hazen"`.

    The mean of the quantile function over as much of the weight as one value has of m equal ones; where weights differ
    m is their effective number (Kish 1965). A straight line between two values would hang on the order of equal ones.

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
    order = np.argsort(values, -1)
    values = np.take_along_axis(values, order, -1)
    # In double precision: what rounding leaves of a neighbour's part must not count, be it a million times as large.
    weight = weight / weight.sum(-1, dtype=np.float64, keepdims=True)
    weight = np.take_along_axis(np.broadcast_to(weight, values.shape), order, -1)
    above = weight.cumsum(-1)
    below, half = above - weight, np.square(weight).sum(-1, keepdims=True) / 2

    def at(share: float) -> np.ndarray:
        part = np.minimum(above, share + half) - np.maximum(below, share - half)
        part[part < ROUNDING] = 0
        return (part * values).sum(-1) / part.sum(-1)

    return [at(share) for share in shares]
