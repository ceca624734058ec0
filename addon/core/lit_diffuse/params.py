"""How many observations a median keeps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class MedianParams:
    """Of the medians over the frames (`batched`, `adaptive`).

    Attributes
    ----------
    slots, knots : int
        Places of an element and channel, and those that knots take once its observations are more.
    exact_bytes : int
        Bytes an element that observations may take on disk, in the mean: 14 observations. `Batched` takes 244
        in memory.
    """

    slots: int = 20
    knots: int = 12
    exact_bytes: int = 224


MEDIANS = MedianParams()
