"""Parameters of the light that a scan without objects lacks; what it gains: docs/ablation.md."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MissingLightParams:
    """Of `missing_light`.

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
    lamp : float
        Times its clipped value, in each channel, that the room's light must ask for of a patch that is called a lamp.
    """

    gain: float = 0.07
    rays: int = 2048
    merged: int = 2
    sky: float = float(np.radians(30))
    least_seen: float = 2e-4
    alike: float = 3.0
    lamp: float = 2.0


MISSING = MissingLightParams()
