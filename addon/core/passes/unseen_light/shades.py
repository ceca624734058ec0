"""Light that lamps throw by way of what nobody saw around them: the insides of their shades.

A bulb that no frame sees is told by what it throws, and a good part of that comes by way of its shade, whose inside no
frame sees either. Without that part two bulbs in a bedroom came out at 1.30 and 1.43 of their luminance (1.06 and 1.24
with it), two in a study at .98 and 1.39 (.93 and 1.08). What counts is what the lamp makes much brighter than anything
seen of that object: the rest is in the light that unseen elements are taken to send anyway.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...brdf.emitter import LAMP_ALBEDO
from ...light.environment import Environment
from ...light.few_elements import contribution_of_object, irradiance_at
from ...light.field import LightField
from ...light.lamps import Lamp
from ...luminance import LUMINANCE
from ...significance import LEVELS
from .params import SHADES


def by_way_of_shade(
    field: LightField, lamp: Lamp, albedo: dict[int, float], even: np.ndarray, element: np.ndarray, seed: int
) -> np.ndarray:
    """E that a lamp at radiance 1 throws by way of unseen elements around it, (m,) float64.

    Parameters
    ----------
    field : LightField
        What nobody saw is dark in it.
    albedo : dict of float
        Of objects, as far as it is known.
    even : (n, 3) float32
        L_d with each object's own median where nobody saw it (`few_elements.evened`).
    element : (m,) int
        Where E is wanted.
    """
    atlas = field.atlas
    own = atlas.object_id == lamp.object_id
    centre = np.average(atlas.position[own], 0, atlas.area[own])
    reach = SHADES.reach * np.sqrt(atlas.area[own].sum() / (4 * np.pi))
    near = np.flatnonzero(~own & ~field.radiance.any(1) & (np.linalg.norm(atlas.position - centre, axis=1) < reach))
    nothing = np.zeros(len(element))
    if len(near) < LEVELS.enough:
        return nothing
    rng = np.random.default_rng([seed, lamp.object_id])
    places = rng.choice(near, min(SHADES.places, len(near)), replace=False)
    closest = cKDTree(atlas.place(places)).query(atlas.place(near), workers=-1)[1]
    rho = np.clip([albedo.get(int(i), LAMP_ALBEDO) for i in atlas.object_id[near]], SHADES.darkest, SHADES.lightest)
    from_lamp = contribution_of_object(field, places, lamp.object_id, seed)
    bright = float(lamp.radiance @ LUMINANCE)
    enough = SHADES.strongly * (even[near] @ LUMINANCE) / max(bright, 1e-12)
    sent, unlit = rho * from_lamp[closest] / np.pi, field.with_sun(None)
    if (sent > enough).sum() < LEVELS.enough:
        return nothing

    def with_only(index: np.ndarray, radiance: np.ndarray) -> LightField:
        """The room with light from these elements only."""
        values = np.zeros_like(field.radiance)
        values[index] = radiance[:, None]
        return unlit.with_light(values, Environment.dark(), ())

    for bounce in range(SHADES.bounces - 1):
        from_shade = irradiance_at(with_only(near, sent), places, seed + bounce)[:, 0]
        sent = rho * (from_lamp + from_shade)[closest] / np.pi
    strong = sent > enough
    return irradiance_at(with_only(near[strong], sent[strong]), element, seed)[:, 0]
