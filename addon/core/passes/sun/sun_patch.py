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
from .sun_fit import RADII, SHARP, along_edges, distinct, of_luminance, pattern_search, reaching_most
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
    outliers = spots.over() | spots.stands_out() & ~np.isin(spots.sample.object_id, patches)
    direction = direction_of(spots, outliers, dark.environment)
    if direction is None:
        return None
    lit_objects = np.unique(spots.sample.object_id[spots.contribution(direction) > 0])
    pool = spread_over(dark, seen[np.isin(dark.atlas.object_id[seen], lit_objects)], SAMPLES.in_all, rng)
    edge_elements = along_edges(dark, pool, direction, rng)
    strengths = np.zeros(4)
    if len(edge_elements):
        strengths = strength_of(
            Spots(dark, edge_elements, irradiance_at(lit, edge_elements, seed)),
            direction,
            lit_diffuse.clipped[edge_elements] > 0.5,
        )
    if not (strengths > 0).all():
        return None
    sun = Sun(direction, of_luminance(strengths))
    return replace(
        sun, note=f"A sun that no frame sees was solved from the patch of light that it throws: {sun.where()}."
    )


def direction_of(spots: Spots, outliers: np.ndarray, sky: Environment) -> np.ndarray | None:
    """Unit vector towards a sun that lights mainly the `outliers` ((m,) bool), (3,) float32; None without one.

    It stands where frames don't tell the `sky`.
    """
    if outliers.sum() < LEVELS.enough:
        return None

    def guess_of(direction: np.ndarray) -> Guess:
        return Guess(direction, -_log_likelihood_ratio(outliers, spots.contribution(direction) > 0))

    sample = np.flatnonzero(outliers)
    sample = sample[:: -(-len(sample) // LEVELS.of_object)]
    directions = reaching_most(spots, sample, np.ones(len(sample)), sky)
    guesses = distinct(list(ordered_map(guess_of, directions, 0)))[: SUN.tried]
    refined = ordered_map(lambda guess: pattern_search(guess_of, guess, SHARP), guesses, 0)
    best = min(refined, key=lambda guess: guess.cost, default=None)
    if best is None:
        return None
    lit = spots.contribution(best.direction) > 0
    return best.direction if lit.sum() >= LEVELS.enough and 2 * (outliers & lit).sum() > lit.sum() else None


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
    distance, nearest = cKDTree(key[shade]).query(key[lit], distance_upper_bound=SUN.near)
    a, b = lit[np.isfinite(distance)], shade[nearest[np.isfinite(distance)]]
    if len(a) < LEVELS.enough or clipped[a].all():
        return np.zeros(4)
    strengths = []
    for weights in (*np.eye(3), LUMINANCE):
        value, received = spots.log_albedo(weights=weights), spots.sample.received @ weights
        needed = received[a] * (np.exp(value[a] - value[b]) - 1) / contribution[a]
        survival = ecdf(CensoredData.right_censored(needed, clipped[a])).sf
        half = np.flatnonzero(survival.probabilities <= 0.5)
        strengths.append(survival.quantiles[half[0]] if len(half) else needed[~clipped[a]].max())
    return np.array(strengths)


def _log_likelihood_ratio(outliers: np.ndarray, lit: np.ndarray) -> float:
    """Log likelihood that what is `lit` has more `outliers` than the rest, over that of one share; 0 if fewer."""
    table = np.array(
        [[(outliers & lit).sum(), (~outliers & lit).sum()], [(outliers & ~lit).sum(), (~outliers & ~lit).sum()]], float
    )
    if table[0, 0] * table[1, 1] <= table[0, 1] * table[1, 0]:
        return 0.0
    expected = table.sum(1, keepdims=True) * table.sum(0) / table.sum()
    return float((table * np.log(np.maximum(table, 1e-9) / np.maximum(expected, 1e-9))).sum())
