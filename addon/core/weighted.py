"""The weighted median."""

import numpy as np


def weighted_median(values: np.ndarray, weight: np.ndarray) -> float:
    """The first of the values ((m,)), in rising order, that at least half of the weight ((m,)) does not exceed."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)])
