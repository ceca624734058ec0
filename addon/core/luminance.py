"""How bright linear Rec.709 looks."""

from collections.abc import Iterable

import numpy as np

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Weights of red, green and blue (ITU-R BT.709)."""


def rgb(values: Iterable[float]) -> tuple[float, float, float]:
    """A colour's three numbers as plain floats."""
    red, green, blue = (float(x) for x in values)
    return red, green, blue
