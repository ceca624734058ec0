"""Parameters of specular removal."""

from dataclasses import dataclass


@dataclass(frozen=True)
class RemovalParams:
    """How the specular part is predicted, and when it is accepted.

    Attributes
    ----------
    rays : int
        Of a pixel: a sixteenth of what an observation has in the fit, as neighbours share theirs.
    pixels : int
        Of a frame that are traced, about; of a larger one, one in each square cell.
    reach : int
        Pixels, or cells, whose rays are shared: two standard deviations of their weights.
    most : float
        Times the remainder that the specular part may be.
    """

    rays: int = 8
    pixels: int = 1 << 17
    reach: int = 2
    most: float = 3.0


REMOVAL = RemovalParams()
