"""Elements grouped by what they belong to."""

from __future__ import annotations

import numpy as np


def by_label(label: np.ndarray) -> list[np.ndarray]:
    """Indices of the elements that share each label ((n,) int), by rising label, each group in its old order.

    One empty group where there are no elements.
    """
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
