"""Parameters of the light that a scan without objects lacks; what it gains: docs/ablation.md."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MissingLightParams:
    """Of `missing_light`.

    Chosen on three phone-made rooms (a living room, a kitchen, a bathroom), by the PSNR of albedo at the sample, one
    changed at a time from `sources` .2 and a usual albedo of .45, which give 18.28 dB in the mean: `sources` .1 18.67,
    .4 17.98; that albedo .5 18.41; `level` .1 17.96; `unlike` 1 18.62; `highest` .8 18.23, a gain in the living room
    and a loss in the bathroom. The sample alone tells too little: in eleven rooms `unlike` 1 gains .33 +- .08 dB there,
    and in the pictures of seven -.10 +- .18.

    Attributes
    ----------
    gain : float
        Share by which it must lower the spread of log albedo within planes to be believed in. In seven rooms with HDR
        frames and fused meshes it does so by .35, .18 and .11 where the albedo gains or stays, by .04 or less in the
        four where it loses; in nine phone-made ones by .20 to .59. Albedos above 1 in 5 % of the elements, the
        criterion before, told of a loss of 6 dB and not of a gain of 10.
    rays : int
        Of each of them into its hemisphere, to find through which cells it sees out.
    merged : int
        Cells along either axis that are one unknown.
    sky : float
        Radians either way of the parts in which clipped sky is solved for.
    least_seen : float
        Mean irradiance that an unknown of radiance 1 gives, below which it is left at the room's own radiance.
    alike : float
        Times the area of another patch in its plane up to which one is the same lamp (`same_lamps`). A lamp's edge is
        off by an element or a triangle of the scan: spots of .0062 and .0092 square metres came out at .006 to .021.
    apart : float
        Difference of log albedo from which on two elements count as of two paints (Cauchy's scale). Seven phone-made
        rooms, in four of them two seeds: .07 gains .15 +- .13 dB over .1, .05 .28 +- .12, .035 .30 +- .14.
    level : float
        Weight of the prior on log albedo, normal about `TYPICAL_ALBEDO` with the deviation `deviation`.
    deviation : float
    highest : float
        The greatest albedo of usual paint. What is above it counts in tenths of log albedo, by the square up to
        `LEVELS.sigmas` of them and linearly beyond (pseudo-Huber).
    sources : float
        Weight of the prior that an opening shows daylight as bright as the room, and a patch its clipped value: a lamp
        is an exception (Student's t).
    unlike : float
        Its scale, in log radiance, of all channels together.
    tint : float
        The same of what channels differ by: a lamp may be far brighter than the room, but hardly of another colour.
        With the channels apart, a phone's room got cyan light from its ceiling.
    start : float
        Times that, where the search starts.
    lamp : float
        Times its clipped value, in each channel, that the room's light must ask for of a patch that is called a lamp.
    """

    gain: float = 0.07
    rays: int = 2048
    merged: int = 2
    sky: float = float(np.radians(30))
    least_seen: float = 2e-4
    alike: float = 3.0
    apart: float = 0.05
    level: float = 0.03
    deviation: float = 0.5
    highest: float = 0.85
    sources: float = 0.1
    unlike: float = 0.5
    tint: float = 0.3
    start: float = 3.0
    lamp: float = 2.0


MISSING = MissingLightParams()
