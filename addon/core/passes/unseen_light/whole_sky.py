"""A sky of which no frame saw anything, solved for as one radiance from what it throws into the room."""

import numpy as np

from ...light.environment import Environment
from ...light.few_elements import filled_radiance, irradiance_at
from ...light.field import LightField
from ...light.lamps import find_seen
from ...light.light_fit import Sample
from ...light.params import SKY
from ...luminance import LUMINANCE
from ...significance import LEVELS
from .params import UNSEEN


def with_whole_sky(field: LightField, element: np.ndarray, seed: int) -> tuple[LightField, tuple[str, ...]]:
    """Solve for one radiance of all the sky where rays leave the mesh but no frame looked there; says so in a note."""
    if field.environment.seen:
        return field, ()
    everywhere = Environment.only(np.ones((1, 2), np.float32))
    dark = field.with_sun(None).with_light(np.zeros_like(field.radiance), everywhere)
    contribution = irradiance_at(dark, element, seed)[:, 0]
    if contribution.mean() < SKY.least_share * np.pi:
        return field, ()
    received = irradiance_at(field.with_light(filled_radiance(field)), element, seed)
    object_id, sent = field.atlas.object_id[element], field.radiance[element].astype(np.float64)
    usable = np.ones(len(element), bool)
    fit = None
    for _ in range(UNSEEN.sweeps):
        sample = Sample(element[usable], object_id[usable], sent[usable], received[usable])
        fit = sample.best(sent[usable] @ LUMINANCE, received[usable] @ LUMINANCE, contribution[usable])
        if fit is None or fit[2] > (1 - LEVELS.gain) * fit[1]:
            return field, ()
        # Lamps show themselves once the rest is lit; their albedo says nothing of the sky.
        lamps = find_seen(object_id, sent, received + fit[0] * contribution[:, None])
        usable = ~np.isin(object_id, [lamp.object_id for lamp in lamps])
        if usable.sum() < LEVELS.enough:
            return field, ()
    assert fit is not None  # there was a sweep
    radiance = np.full(3, fit[0])
    at = np.searchsorted(element, sample.element)
    by_channel = [sample.best(sample.radiance[:, c], sample.received[:, c], contribution[at]) for c in range(3)]
    solved = [channel[0] for channel in by_channel if channel is not None]
    if len(solved) == 3:
        radiance = np.array(solved)
    # No object reflects more than it gets.
    floor = (np.pi * sample.radiance - sample.received) / np.maximum(contribution[at], 1e-3 * contribution.mean())[
        :, None
    ]
    for number in np.unique(sample.object_id):
        radiance = np.maximum(radiance, np.median(floor[object_id[usable] == number], 0))
    note = (
        "Part of the light comes from a sky that no frame sees; it was solved from what it throws, as one radiance "
        f"from all sides: {', '.join(f'{x:.3g}' for x in radiance)} "
        f"(spread of log albedo {fit[1]:.3f} to {fit[2]:.3f})."
    )
    sky = Environment(np.broadcast_to(np.float32(radiance), (1, 2, 3)).copy(), np.zeros((1, 2), np.int32))
    return field.with_light(field.radiance, sky), (note,)
