"""A picture in memory, of whatever kind its file was."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinds import Limit

MAX_PIXELS: Limit[int] = 1 << 26
"""Largest picture that is read at all: 67 million pixels, above the 48 of phones."""


class Picture(NamedTuple):
    """A picture, row 0 at the top.

    Attributes
    ----------
    rgb : (h, w, 3) float32
        Linear Rec.709; NaN where the display window is larger than the data.
    alpha : (h, w) float32 or None
    """

    rgb: np.ndarray
    alpha: np.ndarray | None
