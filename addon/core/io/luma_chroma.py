"""Luminance and chroma to RGB, as OpenEXR stores pictures for which sharp colour does not matter.

RY = (R - Y) / Y and BY = (B - Y) / Y, at every other pixel of every other line; Y = R w_R + G w_G + B w_B.
Source: openexr.com, "Technical Introduction", luminance/chroma images; the filter's weights: `ImfRgbaYca`.
"""

from __future__ import annotations

import numpy as np

from .primaries import luminance_weights

TAPS = np.array([0.002128, -0.007540, 0.019597, -0.043159, 0.087929, -0.186077, 0.627123])
"""Weights of the stored samples at the distances 13, 11, ... 1 from a pixel between two of them, on each side."""


def to_rgb(y: np.ndarray, ry: np.ndarray, by: np.ndarray, chromaticities: tuple[float, ...]) -> np.ndarray:
    """Give linear RGB of the file's own primaries.

    Parameters
    ----------
    y : (h, w) float32
    ry, by : (h, w) or (ceil(h / 2), ceil(w / 2)) float32

    Returns
    -------
    (h, w, 3) float32
    """
    weights = luminance_weights(chromaticities)
    height, width = y.shape
    red, blue = ((_full(chroma, (height, width)) + 1) * y for chroma in (ry, by))
    green = (y - weights[0] * red - weights[2] * blue) / weights[1]
    return np.stack([red, green, blue], -1).astype(np.float32)


def _full(chroma: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Chroma at every pixel of `shape`."""
    if chroma.shape == shape:
        return chroma
    chroma = np.nan_to_num(chroma, nan=0.0, posinf=0.0, neginf=0.0)  # one bad sample would spread over 27 pixels
    return _doubled(_doubled(chroma, shape[1]).T, shape[0]).T


def _doubled(lines: np.ndarray, length: int) -> np.ndarray:
    """(n, length) from (n, ceil(length / 2)): the samples, and between them the filter; the ends go on as they are."""
    reach = len(TAPS)
    result = np.repeat(lines, 2, 1)[:, :length]
    padded = np.pad(lines, ((0, 0), (reach - 1, reach)), mode="edge")
    between = length // 2
    result[:, 1::2] = sum(
        tap * (padded[:, k : k + between] + padded[:, 2 * reach - 1 - k : 2 * reach - 1 - k + between])
        for k, tap in enumerate(TAPS)
    )
    return result
