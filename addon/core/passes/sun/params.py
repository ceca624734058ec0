"""When a sun that no frame sees is believed in; what it gains: docs/ablation.md."""

from dataclasses import dataclass

from ...significance import LEVELS


@dataclass(frozen=True)
class SunParams:
    """Of `sun_fit` and `sun_spots` (`sun` in the ablation).

    The spread of log albedo around the patch, and the differences of neighbours along its edges, must each fall by
    `LEVELS.gain`. A bedroom with a sun: 0.28 to 0.39 and 0.25, with a striped blanket in it; a box with one: 0.63 and
    0.65. A living room without one: 0.01. Bright rectangles on a box's floor: up to 0.45, but no gain along the edges.

    Attributes
    ----------
    reached : float
        Least share of what stands out that a direction must reach.
    kept, refined, tried : int
        Directions of the grid of which the whole sample is asked; of these, those that are refined on it; and then on
        the elements around what stands out.
    even : int
        Elements over the whole surface that tell which stand out (`sun_patch`).
    near, dense : float, int
        Metres around what stands out; elements from there, and from elsewhere on the same objects, for the refinement.
    colour : float
        A channel's irradiance differs from the luminance by this factor at most: a low sun's is 1.4 and 0.65. What is
        brighter in a channel is no sun: a kitchen's table under copper shades had 1.67 in red.
    over : float
        Elements that reflect more than this share of what they get are short of light.
    stands_out : float
        So may be those whose log albedo is so far above their object's median (2.7 times).
    """

    reached: float = 0.05
    kept: int = 160
    refined: int = 24
    tried: int = 4
    even: int = 2 * LEVELS.sample
    near: float = 0.3
    dense: int = 2000
    colour: float = 1.6
    over: float = 1.2
    stands_out: float = 1.0


SUN = SunParams()
