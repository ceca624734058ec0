"""The irradiance of a sun that no frame saw, solved for again once the specular part of L_d is known.

Where the sun does not fall, a varnished floor still reflects the sky, some .05 of E; where its own albedo is no more
than that, light and shade look less unlike than they are, and the sun too weak, most so in the channel in which the
floor is darkest.
"""

from dataclasses import replace

import numpy as np

from ...light.field import LightField
from ...light.sun import Sun
from ...scene.params import SAMPLES
from ...significance import LEVELS
from .sun_fit import along_edges, is_sunlike, of_luminance
from .sun_spots import Edges, Spots


def strength_without_gloss(
    field: LightField, diffuse: np.ndarray, irradiance: np.ndarray, good: np.ndarray, clipped: np.ndarray, seed: int = 0
) -> Sun | None:
    """The field's sun with the irradiance that makes light and shade alike; None where too few tell it, or no sun's.

    Nor where most of what it lights is clipped: what it throws tells more than a lower bound does (`clipped_sunlight`).

    Parameters
    ----------
    field : LightField
        With the sun.
    diffuse : (n, 3) float32
        L_d less its specular part.
    irradiance : (n, 3) float32
        E without the sun.
    good : (n,) bool
        Elements that may be asked.
    clipped : (n,) bool
        Whether their radiance is a lower bound.
    """
    sun, object_id = field.sun, field.atlas.object_id
    assert sun is not None
    rng = np.random.default_rng([seed, 5])
    pool = np.flatnonzero(good)
    pool = np.sort(rng.choice(pool, min(len(pool), SAMPLES.in_all), replace=False))
    beside = along_edges(field, pool, sun.direction)
    if len(beside) < LEVELS.few:
        return None
    received, lower = irradiance[beside].astype(np.float64), clipped[:, None].repeat(3, 1)
    spots = Spots(field.with_light(diffuse), beside, received, object_id, lower)
    strengths = Edges(spots).strengths(sun.direction, bounds=False)
    if strengths[-1] <= 0 or not is_sunlike(strengths):
        return None
    return replace(sun, irradiance=of_luminance(strengths))
