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
    least_told : int, float
        At least so many elements, and this share of those that were looked at, must have a background that frames know.
        A brass pole three pixels wide passed for glass by 6 % of its elements, whose pixels truly mixed it with the
        wall behind; glass and foliage had 78 to 91 %.
    """

    surfaces: int = 8
    least_told: float = 0.1


SEE_THROUGH = SeeThroughParams()
