"""Colours of the page: quantities as heat, models."""

import numpy as np

from ..kinds import Shown

HEAT = np.array(
    [(12, 8, 38), (75, 12, 107), (145, 38, 103), (207, 68, 70), (246, 125, 21), (251, 200, 60), (252, 255, 200)],
    np.float32,
)
"""Dark to light, also in grey (anchors of the inferno map of matplotlib, CC0, rounded)."""
NOTHING: Shown[tuple[int, int, int]] = (40, 40, 46)


def heat(values: np.ndarray, top: float) -> np.ndarray:
    """(...) values from 0 to `top` as (..., 3) uint8."""
    at = np.clip(np.nan_to_num(values, nan=0.0, posinf=top) / top, 0, 1) * (len(HEAT) - 1)
    low = np.minimum(at.astype(np.int32), len(HEAT) - 2)
    share = (at - low)[..., None]
    return ((1 - share) * HEAT[low] + share * HEAT[low + 1] + 0.5).astype(np.uint8)


def heat_css() -> str:
    """The same as a CSS gradient, for the legend."""
    stops = ", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*colour) for colour in HEAT)
    return f"linear-gradient(to right, {stops})"


def gloss(colour: tuple[int, int, int], alpha: float | None) -> tuple[int, int, int]:
    """A model's colour, lighter the glossier."""
    polish = 0.0 if alpha is None else 1 - float(np.sqrt(alpha))
    red, green, blue = (int(c + (255 - c) * 0.7 * polish) for c in colour)
    return red, green, blue
