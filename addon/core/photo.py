"""Radiance and reflectance as pictures that a screen shows."""

import numpy as np

from .kinds import Unit

MIDDLE_GREY: Unit[float] = 0.18
"""What a grey card reflects, and what an exposure puts a picture's median at."""


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear Rec.709 in 0...1 as sRGB in 0...1."""
    x = np.clip(np.nan_to_num(linear), 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)


def srgb_to_linear(codes: np.ndarray) -> np.ndarray:
    """Linear light, float64, of codes in 0...1 of any shape (IEC 61966-2-1)."""
    codes = np.asarray(codes, np.float64)
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def encoded(linear: np.ndarray) -> np.ndarray:
    """Linear Rec.709 in 0...1 as sRGB bytes."""
    return (255 * srgb(linear) + 0.5).astype(np.uint8)


def photo(radiance: np.ndarray, middle: float) -> np.ndarray:
    """Radiance as a photo whose grey lies at `middle`; bright light levels off instead of being cut."""
    return encoded(1 - np.exp(-0.2 / max(middle, 1e-30) * np.maximum(np.nan_to_num(radiance), 0)))
