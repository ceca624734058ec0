"""What it takes to believe that something is transparent or cut out; what it gains: docs/ablation.md."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SeeThroughParams:
    """Of `see_through` (`see-through` in the ablation).

    Attributes
    ----------
    surfaces : int
        Of one object, crossed by a ray, at most.
    least_views, least_elements, least_told : int, float
        At least so many elements, and this share of those that were looked at, must have a background that frames know.
        A brass pole three pixels wide passed for glass by 6 % of its elements, whose pixels truly mixed it with the
        wall behind; glass and foliage had 78 to 91 %.
    least_passed : float
        Less than this share of the background, or of the elements with a hole, is nothing to set an object apart for.
    min_gain, min_sigmas : float
        The held-out cost must fall by this share against the best opaque model, and by this many standard errors. Of
        opaque objects in the living room and four small rooms none gained more than 0.08, and none passed more than
        0.02.
    inside : float
        Times the mesh's noise that a ray must be from an object's outline, to tell whether the object lets through what
        is behind it. A bottle cap of 4 cm, inflated by a scan's error, passed for glass: its outermost centimetre truly
        showed the room behind.
    """

    surfaces: int = 8
    least_views: int = 4
    least_elements: int = 12
    least_told: float = 0.1
    least_passed: float = 0.1
    min_gain: float = 0.1
    min_sigmas: float = 3.0
    inside: float = 3.0


SEE_THROUGH = SeeThroughParams()
