"""What no frame saw reflects like the rest of its object, under the light that reaches it: a rough first pass."""

from functools import partial

import numpy as np

from ..light.field import LightField
from ..light.over_surface import RayCounts, irradiance
from ..light.params import GATHER
from ..passes.albedo.albedo import fill, quotient
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Instance, class_names

ROUGH: RayCounts = {"rays": 64, "emitter_rays": 4, "portal_rays": 8}


def with_unseen_surfaces(
    field: LightField,
    told: np.ndarray,
    lit_diffuse: LitDiffuse,
    instances: tuple[Instance, ...],
    emitters: set[int],
    *,
    finest: float,
    smooth: bool,
    threads: int,
    seed: int,
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
    finest, smooth, threads, seed
        Of `irradiance`.

    Returns
    -------
    field : LightField
    E : (n, 3) float32
        Rough, everywhere.
    escaped : (n,) float32
        Share of the rays that left the mesh, where not `told`.
    """
    atlas, lit, dark = field.atlas, np.flatnonzero(told), np.flatnonzero(~told)
    rough = partial(irradiance, **ROUGH, interpolate=True, smooth=smooth, threads=threads, seed=seed)
    E, escaped = np.zeros((len(atlas), 3), np.float32), np.zeros(len(atlas), np.float32)
    E[lit] = rough(field, lit, finest=GATHER.unseen_coarser * finest)[0]
    E[dark], escaped[dark], _, _ = rough(field, dark, finest=GATHER.unseen_coarser * finest)
    rho, valid = quotient(lit_diffuse.radiance, E)
    guess = fill(atlas, rho, valid, class_names(instances), emitters).rho
    radiance = field.radiance.copy()
    radiance[dark] = guess[dark] * E[dark] / np.float32(np.pi)
    return field.with_light(radiance), E, escaped
