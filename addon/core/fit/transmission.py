"""What is found of an object that shows what lies behind it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SeeThrough:
    """How an object lets through what is behind it.

    Attributes
    ----------
    transmission : float
        Share tau of the background's radiance that passes the whole object; of a cut-out, the share of holes.
    surfaces : float
        How many of the object's surfaces a ray crosses, in the mean.
    score : float
        Held-out cost relative to that of the Lambertian model.
    gain, sigmas : float
        Share of the best opaque model's held-out cost that is saved, and that in standard errors.
    """

    transmission: float
    surfaces: float
    cut_out: bool
    score: float
    gain: float
    sigmas: float
