"""What is made of the stages' results."""

from dataclasses import dataclass


@dataclass(frozen=True)
class CorrectedParams:
    """Of what is made of the stages' results (`corrected`, `refit`).

    Attributes
    ----------
    rounds : int
        Albedo is clamped at 1 and shrunk towards its neighbours, so its mean follows E but roughly.
    around : float
        Edges of an element around a spot of known albedo within which its elements lie: three by three of them.
    least_light : float
        Less than this of its light no lamp is left.
    doubtful : float
        A white that scales E by more than this, or its inverse, is more likely not that white.
    """

    rounds: int = 4
    around: float = 1.5
    least_light: float = 0.1
    doubtful: float = 1.5


CORRECTED = CorrectedParams()


@dataclass(frozen=True)
class PartsParams:
    """Of textures in parts, one for each object (`parts`).

    Attributes
    ----------
    finest : float
        Times that an object's texels may be finer than the room's.
    worth : float
        Finer by less than this is not worth another look at the frames.
    most_texels : int
        Of all parts together: one and a half times an atlas of 4096. Memory, a few gigabytes for this, ends there.
    """

    finest: float = 4.0
    worth: float = 1.2
    most_texels: int = 25_000_000


PARTS = PartsParams()
