"""What the removal of specular parts is told."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RemovalParams:
    """How the specular part is predicted, and when it is believed.

    Attributes
    ----------
    fewer, least : int
        So many times fewer rays a pixel than an observation has in the fit, and at least so many.
    pixels : int
        Of a frame that are traced, about; of a larger one, one in each square cell.
    reach, width : int, float
        Pixels, or cells, whose rays are shared, and the standard deviation of their weights.
    most : float
        Times what is left that the specular part may be.
    dark : float
        An object with more than this share of its elements under such specular parts is dark by itself.
    """

    fewer: int = 32
    least: int = 8
    pixels: int = 1 << 17
    reach: int = 2
    width: float = 1.0
    most: float = 3.0
    dark: float = 0.5


REMOVAL = RemovalParams()
