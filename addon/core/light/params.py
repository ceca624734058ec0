"""How light is gathered and solved for; what each part gains: docs/ablation.md."""

from dataclasses import dataclass


@dataclass(frozen=True)
class GatherParams:
    """Of the irradiance: where rays start and where they are aimed.

    Attributes
    ----------
    patterns : int
        Sets of directions that elements take turns with: neighbours' noise then differs.
    finest_share : float
        Least distance of two gathering points, and edge of the texel blocks, as a share of the room; a texel where that
        is larger. Finer texels then cost look-ups, and rays only where the lamps' light changes; coarse ones are not
        interpolated over (texels of 4 cm in 2 by 2 blocks: relative RMSE 0.15 instead of 0.05).
    smooth : float
        Relative deviation of the lamps' light between a block's corners up to which it is interpolated.
    allowed : float
        Error bound (Ward's epsilon) under which an element is interpolated.
    contrast : float
        Mean relative deviation between an element's neighbours up to which it is interpolated.
    turn : float
        Weight of the normals' difference, in Ward's error.
    off_place : float
        How far a texel may lie from where its block's corners put it, as a share of the block's edge.
    stretch : float
        A block this many times larger on the surface than its texels should be spans a gap.
    bright : float
        A triangle is bright from this multiple of the surface's mean radiance on. Only the noise depends on it, not the
        expectation: what is not aimed at is still gathered.
    max_triangles : int
        Finely meshed lamps have many: 24 of 512 triangles each, cut off at 4096, had an error of 0.74 instead of 0.06.
    cells : int
        Cells along either axis of each of the box's six sides.
    pilot_rays : int
        Of each of `LEVELS.sample` points, which find the openings.
    both_halves : float
        Two halves of well-spread rays are better together than two that know nothing of each other (living room: the
        halves' difference is 1.35 times the scatter over seeds).
    mirror_fewer : int
        What comes by a mirror is little of the light: so many times fewer rays are aimed at it.
    proposals : tuple[float, ...]
        Widths (phi) of the lobes that rays are drawn from.
    unseen_coarser : int
        Times the finest spacing of gathering points.
    lamp_in_opening : float
        Times the luminance that cells of the box have as a rule, from which on what comes in by one is a lamp.
    """

    patterns: int = 64
    finest_share: float = 0.005
    smooth: float = 0.05
    allowed: float = 0.2
    contrast: float = 0.15
    turn: float = 1.5
    off_place: float = 0.15
    stretch: float = 3.0
    bright: float = 8.0
    max_triangles: int = 1 << 16
    cells: int = 24
    pilot_rays: int = 64
    both_halves: float = 0.75
    mirror_fewer: int = 4
    proposals: tuple[float, ...] = (0.015, 0.06, 0.2, 0.6)
    unseen_coarser: int = 8
    lamp_in_opening: float = 4.0


GATHER = GatherParams()


@dataclass(frozen=True)
class LessNoiseParams:
    """Of `less_noise` (`lamp-noise` in the ablation).

    Attributes
    ----------
    cell : float
        Metres, edge of the cells that a mean is taken over.
    grids : int
        Shifted grids of such cells, averaged.
    turned : int
        Steps in which the normal's components are told apart.
    """

    cell: float = 0.12
    grids: int = 3
    turned: int = 4


LESS_NOISE = LessNoiseParams()


@dataclass(frozen=True)
class LightFitParams:
    """Of the lamps and skies that are solved for (`light_fit`, `few_elements`, `field`, `lamps`).

    Attributes
    ----------
    cap : float
        The cap under which a light is looked for: far from the solution, everything deviates.
    flat_cell : float
        Edge in metres of the cells in which normals must agree.
    flat : float
        Least length of a cell's mean normal (8 degrees). E of a bumpy spot is uncertain, and more so that from a small
        light: as an error of the regressor it draws the light's radiance down. The same two lamps, mesh off by 5 mm,
        under a cap of 1: 10 and 15 with all elements, 21 and 22 with those on flat spots.
    alike : float
        Relative difference up to which two solutions of one lamp's luminance agree: by all channels together and each
        by itself, or as pixels show it.
    same : float
        Relative difference of size up to which two objects of a class can be the same lamp, besides a scan's noise.
    reach : float
        Factor within which a lamp's luminance is its class's, and a sky's radiance its middle's.
    rays, emitter_rays : int
        Of each element that a solution looks at: into its hemisphere, at bright triangles, at openings.
    more_rays : int
        Times those for the light that is known where unseen lamps and skies are solved for, and at clipped lamps: noise
        of the one draws what is solved up, of the other down (errors in variables). Bare spots of a kitchen: 1.19 times
        too bright without, 1.15 with, three seeds. An office's lamps, hidden from HDR frames, light it with .88 to .97
        of E without, with 1.00 to 1.04, three seeds.
    emitter_albedo : float
        An object whose median albedo would have to be above this gives light of its own. 1 is the physical bound; the
        rest is room for missing light and for noise.
    """

    cap: float = 1.0
    flat_cell: float = 0.08
    flat: float = 0.99
    alike: float = 0.25
    same: float = 0.05
    reach: float = 3.0
    rays: int = 256
    emitter_rays: int = 64
    more_rays: int = 4
    emitter_albedo: float = 2.0


LIGHT_FIT = LightFitParams()


@dataclass(frozen=True)
class JointFitParams:
    """Of sources that are solved for together (`joint_fit`).

    Chosen on three phone-made rooms (a living room, a kitchen, a bathroom), by the PSNR of albedo at the sample, one
    changed at a time from `sources` .2, which give 18.28 dB in the mean: `sources` .1 18.67, .4 17.98; `unlike` 1
    18.62; `highest` .8 18.23, a gain in the living room and a loss in the bathroom. The sample alone tells too little:
    in eleven rooms `unlike` 1 gains .33 +- .08 dB there, and in the pictures of seven -.10 +- .18.

    Attributes
    ----------
    apart : float
        Difference of log albedo from which on two elements count as of two paints (Cauchy's scale). Seven phone-made
        rooms, in four of them two seeds: .07 gains .15 +- .13 dB over .1, .05 .28 +- .12, .035 .30 +- .14.
    highest : float
        The greatest albedo of usual paint. What is above it counts in tenths of log albedo, by the square up to
        `LEVELS.sigmas` of them and linearly beyond (pseudo-Huber).
    white, deviation : tuple of float, float
        Quantiles of albedo over the surface between which it is likely that of white paint, within so much of its
        logarithm, in scans and where lamps or the sun's patch are clipped. In eight rooms (pixels, truth) the .97
        quantile is .71 to .82, and the geometric mean .19 to .46, which is why the mean tells nothing. Six phone-made
        scans, by texels, the light solved anew: +.17 +- .08 dB. A prior on the mean beside it, normal about .5, then
        gains -.05 +- .04 in twelve captures.
    sources : float
        Weight of the prior that a source is as bright as expected: an opening shows daylight as bright as the room, a
        patch its clipped value, and a lamp is an exception (Student's t).
    unlike : float
        Its scale, in log radiance, of all channels together.
    tint : float
        The same of what channels differ by: a lamp may be far brighter than the room, but hardly of another colour.
        With the channels apart, a phone's room got cyan light from its ceiling.
    start : float
        Times that, where the search starts.
    """

    apart: float = 0.05
    highest: float = 0.85
    white: tuple[float, float] = (0.95, 0.99)
    deviation: float = 0.5
    sources: float = 0.1
    unlike: float = 0.5
    tint: float = 0.3
    start: float = 3.0


JOINT_FIT = JointFitParams()


@dataclass(frozen=True)
class SkyParams:
    """Of the environment map and the sun in it (`environment`, `sun`).

    Attributes
    ----------
    max_height : int
        Rows of a map.
    profile : float
        Degrees over which the sky's change with the height is smoothed.
    band : float
        Degrees above the horizon up to which a clipped sky is an unknown of its own: a clear sky is about twice as
        bright there as at the zenith. A hall by a phone, albedo by texels under two seeds: 15 +1.0 and +.8 dB, 25 +1.0;
        two sunlit bedrooms +.1 and +.2, a study -.6 +- .9.
    shadow_rays : int
        Of each element, over the sun's disc.
    above : float
        How often brighter than the sky around it a seen sun must be, and clipped sky can be at most.
    least_share : float
        Of the irradiance by all the sky: less is left in the map.
    """

    max_height: int = 512
    profile: float = 3.0
    band: float = 15.0
    shadow_rays: int = 16
    above: float = 30.0
    least_share: float = 0.02


SKY = SkyParams()
