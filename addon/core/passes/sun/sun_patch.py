"""A sun whose patch the sensor clipped: what the sun lights stands out, and little else is lit by it.

Of a clipped element only a lower bound of its albedo is known, so the spread of albedo (`sun_fit`) tells nothing.
Whether it stands out is known all the same. The direction is that under which lit and unlit tell best what stands out
from what does not: by the likelihood ratio of two shares against one (the G-test). The strength is what makes both
sides of the shadow's edge alike, in the median by Kaplan and Meier (1958), as a clipped side gives a lower bound.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import CensoredData, ecdf

from ...light.environment import Environment
from ...light.few_elements import irradiance_at, spread_over
from ...light.field import LightField
from ...light.sun import Sun
from ...luminance import LUMINANCE
from ...parallel import ordered_map
from ...scene.lit_diffuse import LitDiffuse
from ...scene.params import SAMPLES
from ...significance import LEVELS
from .params import SUN
from .sun_fit import RADII, SHARP, along_edges, apart, of_luminance, reaching_most, searched
from .sun_spots import Guess, Spots


def find_patch_sun(
    dark: LightField, lit: LightField, lit_diffuse: LitDiffuse, patches: list[int], seed: int
) -> Sun | None:
    """The sun that lights what stands out; None where no direction lights mainly that.

    Parameters
    ----------
    dark : LightField
        With L_d: of clipped elements, the level at which they are.
    lit : LightField
        With all light that is known.
    patches : list of int
        Objects that were set apart as they are clipped: among themselves nothing stands out.
    """
    rng = np.random.default_rng([seed, 4])
    seen = np.flatnonzero(lit_diffuse.seen)

    element = spread_over(dark, seen, SUN.even, rng)
    spots = Spots(dark, element, irradiance_at(lit, element, seed))
    out = spots.over() | spots.stands_out() & ~np.isin(spots.sample.object_id, patches)
    direction = direction_of(spots, out, dark.environment)
    if direction is None:
        return None
    lies = np.unique(spots.sample.object_id[spots.contribution(direction) > 0])
    pool = spread_over(dark, seen[np.isin(dark.atlas.object_id[seen], lies)], SAMPLES.in_all, rng)
    along = along_edges(dark, pool, direction, rng)
    told = np.zeros(4)
    if len(along):
        told = strength_of(
            Spots(dark, along, irradiance_at(lit, along, seed)), direction, lit_diffuse.clipped[along] > 0.5
        )
    if not (told > 0).all():
        return None
    sun = Sun(direction, of_luminance(told))
    return replace(
        sun, note=f"A sun that no frame sees was solved from the patch of light that it throws: {sun.where()}."
    )


def direction_of(spots: Spots, out: np.ndarray, sky: Environment) -> np.ndarray | None:
    """Unit vector towards a sun that lights mainly what stands `out` ((m,) bool), (3,) float32; None without one.

    It stands where frames don't tell the `sky`.
    """
    if out.sum() < LEVELS.enough:
        return None

    def told(direction: np.ndarray) -> Guess:
        return Guess(direction, -_ratio(out, spots.contribution(direction) > 0))

    some = np.flatnonzero(out)
    some = some[:: -(-len(some) // LEVELS.of_object)]
    way = reaching_most(spots, some, np.ones(len(some)), sky)
    guesses = apart(list(ordered_map(told, way, 0)))[: SUN.tried]
    refined = ordered_map(lambda one: searched(told, one, SHARP), guesses, 0)
    best = min(refined, key=lambda one: one.cost, default=None)
    if best is None:
        return None
    lit = spots.contribution(best.direction) > 0
    return best.direction if lit.sum() >= LEVELS.enough and 2 * (out & lit).sum() > lit.sum() else None


def strength_of(spots: Spots, direction: np.ndarray, clipped: np.ndarray) -> np.ndarray:
    """Irradiance that makes what is lit like the nearest in shade: each channel's, and luminance's, (4,); 0 if unknown.

    Elements in the shadow's edge are left out, as they look dark and so are the last to be clipped.

    Parameters
    ----------
    clipped : (m,) bool
        Those of the elements of which a lower bound is known.
    """
    full, contribution = spots.contribution(direction), spots.contribution(direction, RADII[-1])
    lit = np.flatnonzero((full > 0) & (contribution > 0.99 * full))
    shade = np.flatnonzero((contribution <= 0) & ~clipped)
    if not len(lit) or not len(shade):
        return np.zeros(4)
    key = np.concatenate([spots.position, 0.2 * spots.normal, 100.0 * spots.sample.group[:, None]], 1)
    far, nearest = cKDTree(key[shade]).query(key[lit], distance_upper_bound=SUN.near)
    a, b = lit[np.isfinite(far)], shade[nearest[np.isfinite(far)]]
    if len(a) < LEVELS.enough or clipped[a].all():
        return np.zeros(4)
    found = []
    for weights in (*np.eye(3), LUMINANCE):
        value, received = spots.log_albedo(weights=weights), spots.sample.received @ weights
        needed = received[a] * (np.exp(value[a] - value[b]) - 1) / contribution[a]
        left = ecdf(CensoredData.right_censored(needed, clipped[a])).sf
        half = np.flatnonzero(left.probabilities <= 0.5)
        found.append(left.quantiles[half[0]] if len(half) else needed[~clipped[a]].max())
    return np.array(found)


def _ratio(out: np.ndarray, lit: np.ndarray) -> float:
    """Log likelihood that what is `lit` stands `out` more often than the rest, over that of one share; 0 if less."""
    table = np.array([[(out & lit).sum(), (~out & lit).sum()], [(out & ~lit).sum(), (~out & ~lit).sum()]], float)
    if table[0, 0] * table[1, 1] <= table[0, 1] * table[1, 0]:
        return 0.0
    expected = table.sum(1, keepdims=True) * table.sum(0) / table.sum()
    return float((table * np.log(np.maximum(table, 1e-9) / np.maximum(expected, 1e-9))).sum())
