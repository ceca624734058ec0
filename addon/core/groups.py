"""Elements grouped by what they belong to."""

import numpy as np


def by_label(label: np.ndarray) -> list[np.ndarray]:
    """Indices of the elements that share each label ((n,) int), by rising label, each group in its old order.

    One empty group where there are no elements.
    """
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def by_number(label: np.ndarray) -> dict[int, np.ndarray]:
    """`by_label`, by the label: hundreds of objects are asked for, and each comparison goes over all elements."""
    return {int(label[own[0]]): own for own in by_label(label) if len(own)}
