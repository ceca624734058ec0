"""When an object is taken for transparent or cut out; what it gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SeeThroughParams:
    """Of `see_through` (`see-through` in the ablation).

    Rays count that lie `LEVELS.sigmas` of the mesh's noise within an object's outline: a bottle cap of 4 cm, inflated
    by a scan's error, passed for glass, as its outermost centimetre truly showed the room behind. The held-out cost
    must fall by `LEVELS.gain` against the best opaque model; opaque objects in five rooms gained up to 0.08.

    Attributes
    ----------
    surfaces : int
        Of one object, crossed by a ray, at most.
    least_told : float
        At least `LEVELS.few` elements, and this share of those that were looked at, must have a background that frames
        know. A brass pole three pixels wide passed for glass by 6 % of its elements, whose pixels truly mixed it with
        the wall behind; glass and foliage had 78 to 91 %. So much must also pass: opaque objects in those rooms passed
        up to 0.02.
    """

    surfaces: int = 8
    least_told: float = 0.1


SEE_THROUGH = SeeThroughParams()
