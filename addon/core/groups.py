"""Elements grouped by what they belong to, or where they lie."""

import numpy as np


def by_label(label: np.ndarray) -> list[np.ndarray]:
    """Indices of the elements that share each label ((n,) int), by rising label, each group in its old order.

    One empty group where there are no elements.
    """
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def cell_of(position: np.ndarray, edge: float) -> np.ndarray:
    """A number for the cell of a grid that each point ((n, 3)) lies in, rising with x, then y, then z, (n,) int64."""
    number = np.zeros(len(position), np.int64)
    for coordinate in position.T:  # one by one: places of all three are the size of six float32 arrays
        place = np.floor(coordinate / edge).astype(np.int64)
        place -= place.min(initial=np.iinfo(np.int64).max)
        number = number * (place.max(initial=0) + 1) + place
    return number


def by_number(label: np.ndarray) -> dict[int, np.ndarray]:
    """`by_label`, by the label: for hundreds of objects, each comparison would go over all elements."""
    return {int(label[members[0]]): members for members in by_label(label) if len(members)}
