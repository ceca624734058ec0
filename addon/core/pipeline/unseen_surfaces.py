"""What no frame saw reflects like the rest of its object, under the light that reaches it.

Twice: roughly before lamps and sky are solved for, and again under all of the light.
"""

from typing import Unpack

import numpy as np

from ..groups import by_number
from ..light.directions import cosine_patterns, turned
from ..light.few_elements import evened, pick
from ..light.field import LightField
from ..light.lamps import find_seen
from ..light.over_surface import Gathering, RayCounts, irradiance
from ..light.params import GATHER
from ..passes.albedo.albedo import fill, quotient
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Instance, class_names
from ..significance import LEVELS

ROUGH: RayCounts = {"rays": 64, "emitter_rays": 4, "portal_rays": 8}


def with_unseen_surfaces(
    field: LightField,
    told: np.ndarray,
    lit_diffuse: LitDiffuse,
    instances: tuple[Instance, ...],
    emitters: set[int],
    **how: Unpack[Gathering],
) -> tuple[LightField, np.ndarray, np.ndarray]:
    """The room with what the elements that are not `told` send.

    Parameters
    ----------
    field : LightField
        With all of its light.
    told : (n,) bool
        Elements whose radiance is known; some are not.
    emitters : set of int
        Objects that are lamps.
    how
        Those of `irradiance`.

    Returns
    -------
    field : LightField
    E : (n, 3) float32
        Rough, everywhere.
    escaped : (n,) float32
        Share of the rays that left the mesh, where not `told`.
    """
    atlas, lit, dark = field.atlas, np.flatnonzero(told), np.flatnonzero(~told)
    E, escaped = np.zeros((len(atlas), 3), np.float32), np.zeros(len(atlas), np.float32)
    E[lit], _ = _rough(field, lit, **how)
    E[dark], escaped[dark] = _rough(field, dark, **how)
    rho, valid = quotient(lit_diffuse.radiance, E)
    guess = fill(atlas, rho, valid, class_names(instances), emitters).rho
    radiance = field.radiance.copy()
    radiance[dark] = guess[dark] * E[dark] / np.float32(np.pi)
    return field.with_light(radiance), E, escaped


def with_unseen_by_light(field: LightField, good: np.ndarray, **how: Unpack[Gathering]) -> LightField:
    """The field with what unseen elements likely send (`LightField.unseen`), in proportion to the light they get.

    The underside of a cupboard gets far less than its doors. Counted as bright as these, it would light the worktop
    below it, and lamps there would be solved for as too weak.

    Parameters
    ----------
    field : LightField
        Dark where no frame looked, without lamps.
    good : (n,) bool
        Elements whose L_d is to be believed.
    """
    even, atlas, seed = evened(field), field.atlas, how["seed"]
    lit = pick(field, good, seed, LEVELS.sample)
    looks = max(ROUGH["rays"] * LEVELS.sample // len(lit), 1)
    start = np.repeat(field.scene.off_surface(atlas.position[lit], atlas.normal[lit]), looks, 0)
    way, _ = turned(cosine_patterns(looks, seed), atlas.normal[lit], np.random.default_rng(seed))
    met = np.unique(field.elements(field.scene.intersect(start, way.reshape(-1, 3))))
    dark = met[(met >= 0) & even[met].any(1) & ~field.radiance[met].any(1)]
    if not len(dark):
        return field
    lit_room = field.with_light(even)
    E, reached = (_rough(lit_room, own, **how)[0] for own in (lit, dark))
    lamps = {lamp.object_id for lamp in find_seen(atlas.object_id[lit], field.radiance[lit], E)}
    usual = np.zeros((int(atlas.object_id.max()) + 1, 3), np.float32)
    for one, own in by_number(atlas.object_id[lit]).items():
        if one not in lamps:
            usual[one] = np.median(E[own], 0)
    usual = usual[atlas.object_id[dark]]
    told = (usual > 0).all(1)
    even[dark[told]] *= reached[told] / usual[told]
    return field.with_unseen(even)


def _rough(field: LightField, element: np.ndarray, **how: Unpack[Gathering]) -> tuple[np.ndarray, np.ndarray]:
    """E ((m, 3) float32) at m elements and the share of rays that left the mesh ((m,)), by few rays at few places."""
    how["finest"] *= GATHER.unseen_coarser
    E, escaped, _, _ = irradiance(field, element, **ROUGH, interpolate=True, **how)
    return E, escaped
