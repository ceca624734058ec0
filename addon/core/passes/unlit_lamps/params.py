"""What lamps are taken to reflect with their light off."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class UnlitParams:
    """Of `unlit`.

    Attributes
    ----------
    dark : float
        Albedo of what is dark: glass before an unlit room, or a screen. Real ones scatter a few per cent.
    dark_classes : tuple of str
        Words in a class's name that say so.
    flat : float
        Share of a lamp's surface, as the square of the cosine to its axis, that faces along it if it is flat: a pane of
        a tenth as thick as wide has .8.
    upright : float
        Radians from the horizontal, at most, of a pane's normal. Flat lamps in ceilings are mostly luminous panels.
    """

    dark: float = 0.02
    dark_classes: tuple[str, ...] = ("window", "pane", "screen", "monitor", "tv", "television", "display", "laptop")
    flat: float = 0.8
    upright: float = float(np.radians(30))


UNLIT = UnlitParams()
