"""All light that no frame shows by itself: lamps and sky, then a sun, then lamps and sky under that sun."""

from collections.abc import Callable, Collection

import numpy as np

from ..light.few_elements import from_sun, irradiance_at
from ..light.field import LightField
from ..light.lamps import LampKinds
from ..light.sun import Sun
from ..passes.sun.sun_fit import find_sun
from ..passes.unseen_light.unseen_light import Light, find_light, lit_by


def find_all_light(
    field: LightField,
    good: np.ndarray,
    unseen_objects: list[int],
    kinds: LampKinds,
    clipped: np.ndarray,
    seed: int = 0,
    tilted: np.ndarray | None = None,
    shining: Collection[int] = (),
    without: Collection[str] = (),
    lacks_light: Callable[[LightField], bool] | None = None,
) -> tuple[Light, Sun | None, bool]:
    """`find_light`, and the sun; parameters are those of `find_light`, and the elements that are `clipped` ((n,) bool).

    A room without a patch that is short of light has what `find_light` gives, to the last bit. A field that has its
    sun keeps it.

    Parameters
    ----------
    lacks_light : callable, optional
        Whether so much light is missing still that a sun can be told only once that is known: last of what is returned.
    """
    light = find_light(field, good, unseen_objects, kinds, seed, tilted, shining, without=without)
    field = light.without_mixed(field)
    lamps = [lamp.object_id for lamp in light.lamps]
    lit_field = field.with_light(lit_by(field, list(light.lamps)), light.environment, lamps)
    missing = lacks_light is not None and lacks_light(lit_field)
    if missing or field.sun is not None or not len(light.received) or "sun" in without:
        return light, field.sun, missing
    object_id = field.atlas.object_id
    unlit = ~np.isin(object_id, lamps)
    free = unlit[light.element]
    sun_fit = find_sun(
        field, light.element[free], light.received[free], good & unlit,
        lambda element: irradiance_at(lit_field, element, seed), object_id, clipped, seed,
    )  # fmt: skip
    if sun_fit is None:
        return light, None, False
    lit_by_sun = field.with_sun(sun_fit.sun)
    light_with_sun = find_light(lit_by_sun, good, unseen_objects, kinds, seed, tilted, shining, light, without)
    if not len(light_with_sun.received):
        return light_with_sun, sun_fit.sun, False
    # Lamps and sky that stood in for the sun no longer do, so its strength is solved for again beside them.
    others = light_with_sun.received - from_sun(field.with_sun(sun_fit.sun), light.element)
    factor = np.maximum(others, 0) / np.maximum(light.received, 1e-12)
    return light_with_sun, sun_fit.under(factor[free]), False
