"""What no frame saw reflects like the rest of its object, under the light that reaches it.

Twice: roughly before lamps and sky are solved for, and again under all of the light.
"""

from typing import Unpack

import numpy as np

from ..groups import by_number
from ..light.directions import cosine_patterns, turned
from ..light.few_elements import filled_radiance, pick
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
    known: np.ndarray,
    lit_diffuse: LitDiffuse,
    instances: tuple[Instance, ...],
    emitters: set[int],
    **gathering: Unpack[Gathering],
) -> tuple[LightField, np.ndarray, np.ndarray]:
    """The room with what the elements that are not `known` send.

    Parameters
    ----------
    field : LightField
        With all of its light.
    known : (n,) bool
        Elements whose radiance is known; some are not.
    emitters : set of int
        Objects that are lamps.
    gathering
        Those of `irradiance`.

    Returns
    -------
    field : LightField
    E : (n, 3) float32
        Rough, everywhere.
    escaped : (n,) float32
        Share of the rays that left the mesh, where not `known`.
    """
    atlas, known_elements, unknown_elements = field.atlas, np.flatnonzero(known), np.flatnonzero(~known)
    E, escaped = np.zeros((len(atlas), 3), np.float32), np.zeros(len(atlas), np.float32)
    E[known_elements], _ = _rough(field, known_elements, **gathering)
    E[unknown_elements], escaped[unknown_elements] = _rough(field, unknown_elements, **gathering)
    rho, valid = quotient(lit_diffuse.radiance, E)
    guess = fill(atlas, rho, valid, class_names(instances), emitters).rho
    radiance = field.radiance.copy()
    radiance[unknown_elements] = guess[unknown_elements] * E[unknown_elements] / np.float32(np.pi)
    return field.with_light(radiance), E, escaped


def with_unseen_by_light(field: LightField, good: np.ndarray, **gathering: Unpack[Gathering]) -> LightField:
    """The field with what unseen elements likely send (`LightField.unseen`), in proportion to the light they get.

    The underside of a cupboard gets far less than its doors. Counted as bright as these, it would light the worktop
    below it, and lamps there would be solved for as too weak.

    Parameters
    ----------
    field : LightField
        Dark where no frame looked, without lamps.
    good : (n,) bool
        Elements whose L_d is reliable.
    """
    radiance, atlas, seed = filled_radiance(field), field.atlas, gathering["seed"]
    sample = pick(field, good, seed, LEVELS.sample)
    rays = max(ROUGH["rays"] * LEVELS.sample // len(sample), 1)
    start = np.repeat(field.scene.off_surface(atlas.position[sample], atlas.normal[sample]), rays, 0)
    directions, _ = turned(cosine_patterns(rays, seed), atlas.normal[sample], np.random.default_rng(seed))
    hit_elements = np.unique(field.elements(field.scene.intersect(start, directions.reshape(-1, 3))))
    dark = hit_elements[(hit_elements >= 0) & radiance[hit_elements].any(1) & ~field.radiance[hit_elements].any(1)]
    if not len(dark):
        return field
    lit_room = field.with_light(radiance)
    E, reached = (_rough(lit_room, elements, **gathering)[0] for elements in (sample, dark))
    lamps = {lamp.object_id for lamp in find_seen(atlas.object_id[sample], field.radiance[sample], E)}
    typical = np.zeros((int(atlas.object_id.max()) + 1, 3), np.float32)
    for object_id, members in by_number(atlas.object_id[sample]).items():
        if object_id not in lamps:
            typical[object_id] = np.median(E[members], 0)
    typical = typical[atlas.object_id[dark]]
    valid = (typical > 0).all(1)
    radiance[dark[valid]] *= reached[valid] / typical[valid]
    return field.with_unseen(radiance)


def _rough(field: LightField, element: np.ndarray, **gathering: Unpack[Gathering]) -> tuple[np.ndarray, np.ndarray]:
    """E ((m, 3) float32) at m elements and the share of rays that left the mesh ((m,)), by few rays at few places."""
    gathering["finest"] *= GATHER.unseen_coarser
    E, escaped, _, _ = irradiance(field, element, **ROUGH, interpolate=True, **gathering)
    return E, escaped
