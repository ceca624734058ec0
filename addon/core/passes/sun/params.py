"""When a sun that no frame sees is believed in; what it gains: docs/ablation.md."""

from dataclasses import dataclass

from ...significance import LEVELS


@dataclass(frozen=True)
class SunParams:
    """Of `sun_fit` and `sun_spots` (`sun` in the ablation).

    Attributes
    ----------
    gain : float
        Share by which the differences of log albedo between neighbours on two sides of the patch's edge must fall: suns
        .36 to .88, other directions, and fourteen rooms without one, up to .13 (a glow in a kitchen, whose cupboard
        became a metal by it).
    along : float
        The same of all neighbours along the edge, also those on one side of it: suns .33 to .63, sheets of paper .04
        or less, the pool of a spotlight less than none.
    off_edge : float
        Or, where albedo does not explain what the patch reflects, the same of what is lit and the nearest in shade, off
        the edge: suns .81 to .95 in ten runs of two rooms as a phone shows them (across the edge .11 to .37, along it
        .00 to .10, as the shadows of a fused mesh lie a little off), other directions up to .17.
    reached : float
        Least share of what stands out that a direction must reach.
    kept, refined, tried : int
        Directions of the grid of which the whole sample is asked; of these, those that are refined on it; and then on
        the edges of their patches.
    even : int
        Elements by which directions are ranked; and over the whole surface, where a room lacks light, those that tell
        what stands out.
    near, dense : float, int
        Metres between an element in a patch and that in shade that tells how bright it would be; elements along its
        edges.
    margin : float
        Metres from the shadow's edge within which light and shade mix. Share of five true suns' irradiance that is
        found with none: .56 to .96, with 4 cm .69 to 1.0.
    colour : float
        A channel's irradiance differs from the luminance by this factor at most: a low sun's is 1.4 and 0.65. What is
        brighter in a channel is no sun: a kitchen's table under copper shades had 1.67 in red.
    over : float
        Elements that reflect more than this share of what they get are short of light.
    stands_out : float
        So may be those whose log albedo is so far above their object's median (2.7 times).
    raised : float
        How much a sun must raise log E of what it lights: suns 1.7 to 3.2, one behind clouds .5; what passes all else
        in rooms without one .1 to .25.
    """

    gain: float = 0.2
    along: float = 0.05
    off_edge: float = 0.5
    reached: float = 0.05
    kept: int = 160
    refined: int = 24
    tried: int = 2
    even: int = 2 * LEVELS.sample
    near: float = 0.3
    dense: int = 2000
    margin: float = 0.04
    colour: float = 1.6
    over: float = 1.2
    stands_out: float = 1.0
    raised: float = 0.4


SUN = SunParams()
