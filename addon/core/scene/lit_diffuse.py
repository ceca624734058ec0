"""The lit diffuse texture L_d: what the frames show of every element, and how much it rests on."""

from dataclasses import dataclass, fields

import numpy as np

CLIPPED_TOO = 0.8
"""Of the level at which an element's brightest channel clips: from there on another may be clipped as well, as the
camera's white balance changes between frames."""


@dataclass(frozen=True)
class LitDiffuse:
    """L_d and its evidence for n elements.

    Attributes
    ----------
    radiance : (n, 3) float32
        L_d, linear Rec.709; NaN where no frame saw the element.
    interquartile_range : (n, 3) float32
        Of the observations; 0 where there are none.
    count : (n,) int32
        Observations that `radiance` rests on.
    tier : (n,) int8
        CLEAN, EDGE or SATURATED: the kind of observations it rests on; -1 where there is none.
    clipped : (n,) float32
        Share of all observations, those that `radiance` does not rest on included, that the sensor clipped.
    """

    radiance: np.ndarray
    interquartile_range: np.ndarray
    count: np.ndarray
    tier: np.ndarray
    clipped: np.ndarray

    def where(self, mask: np.ndarray, other: "LitDiffuse") -> "LitDiffuse":
        """This where `mask` ((n,) bool), the other one elsewhere."""
        parts = ((getattr(self, field.name), getattr(other, field.name)) for field in fields(self))
        return LitDiffuse(*(np.where(mask if a.ndim == 1 else mask[:, None], a, b) for a, b in parts))

    def lower_bounds(self, clip: np.ndarray) -> np.ndarray:
        """Channels that are lower bounds as most frames show the element clipped, (n, 3) bool.

        In frames that clip at the colour `clip` ((3,)) these are about as bright as the brightest; what a sensor holds
        of the others it measures.
        """
        level = np.nan_to_num(self.radiance) / clip
        return (self.seen & (self.clipped > 0.5))[:, None] & (level >= CLIPPED_TOO * level.max(1, keepdims=True))

    @property
    def seen(self) -> np.ndarray:
        """(n,) bool"""
        return self.count > 0
