"""A sun that no frame saw, found by the shadows that its light leaves.

Through an opening the sun throws a sharp patch, in which surfaces seem to reflect more than they get. A direction says
where that patch lies, hence it is looked for among all directions: the right one is that under which albedo varies
least within the objects (`light_fit`), as for any light that no frame saw. Texture, paper and lamplight are bright too,
but no direction puts its patch right over them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ...light.environment import Environment
from ...light.field import LightField
from ...light.sun import Sun, around
from ...luminance import LUMINANCE
from ...parallel import ordered_map
from ...scene.params import SAMPLES
from ...scene.sphere import fibonacci
from ...significance import LEVELS
from .params import SUN
from .sun_spots import Edges, Guess, Spots, visible

GRID = float(np.radians(4.0))
SHARP = np.radians([2.0, 1.0, 0.5])
"""Steps of the direction, with a point-like sun."""
ASTRAY = float(np.radians(2.5))
SOFT = np.radians([0.8, 0.4, 0.2])
RADII = np.radians([0.27, 0.5, 0.75, 1.0])
"""Discs that are tried: thin clouds, and pictures and meshes that are not sharp, soften the edges."""


def _ring(count: int) -> np.ndarray:
    angle = np.arange(count) * (2 * np.pi / count)
    return np.stack([np.cos(angle), np.sin(angle)], 1)


def _on_grid(even: Spots, environment: Environment) -> list[Guess]:
    """Directions of the grid that may be the sun's, the best first."""
    value = even.log_albedo()
    excess = value - np.minimum(even.medians(value, np.ones(len(even), bool)), 0)
    outliers = np.flatnonzero(even.stands_out())
    directions = reaching_most(even, outliers, np.clip(excess[outliers], 0, 3), environment)
    guesses = list(ordered_map(even.explained, directions, 0))
    # A patch may be narrower than the grid is wide, and the guess beside the sun then no better than any other.
    refined = ordered_map(
        lambda guess: pattern_search(even.explained, guess, SHARP[:2]), distinct(guesses)[: SUN.refined], 0
    )
    return distinct(list(refined))[: SUN.tried]


def reaching_most(spots: Spots, index: np.ndarray, weight: np.ndarray, environment: Environment) -> np.ndarray:
    """Directions of the grid that reach most of the spots at `index` ((k,) int), which weigh (k,): (d, 3) float32.

    Of those above the horizon from which frames don't tell what comes.
    """
    directions = fibonacci(int(4 * np.pi / GRID**2)).astype(np.float32)
    directions = directions[(directions[:, 2] > 0) & ~environment.known(directions)]
    spot, ray = np.nonzero(spots.normal[index] @ directions.T > 0)
    origin = spots.scene.off_surface(spots.position[index], spots.normal[index])
    occluded = spots.scene.occluded(origin[spot], directions[ray], np.full(len(spot), np.inf, np.float32))
    reached = np.bincount(ray[~occluded], weight[spot[~occluded]], len(directions)) / max(weight.sum(), 1e-9)
    best = np.argsort(-reached, kind="stable")[: SUN.kept]
    return directions[best[reached[best] > SUN.reached]]


def distinct(guesses: list[Guess]) -> list[Guess]:
    """The guesses that have none better within 1.5 `GRID`, the best first."""
    chosen: list[Guess] = []
    for guess in sorted(guesses, key=lambda guess: guess.cost):
        if all(guess.direction @ better.direction < np.cos(1.5 * GRID) for better in chosen):
            chosen.append(guess)
    return chosen


def pattern_search(cost: Callable[[np.ndarray], Guess], guess: Guess, steps: np.ndarray) -> Guess:
    """The direction of least cost near a guess: the best of eight neighbours, again and again, by smaller steps.

    It stays above the horizon.
    """
    for step in steps:
        for _ in range(4):
            directions = (direction for direction in around(guess.direction, step * _ring(8)) if direction[2] > 0)
            new = min(map(cost, directions), key=lambda candidate: candidate.cost, default=guess)
            if new.cost >= guess.cost:
                break
            guess = new
    return guess


def along_edges(field: LightField, pool: np.ndarray, direction: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Elements of the pool that the direction, or one within `ASTRAY` of it, leaves lit and another does not."""
    directions = around(direction, ASTRAY * np.concatenate([np.zeros((1, 2)), _ring(8), _ring(4) / 2]))
    position, normal = field.atlas.position[pool], field.atlas.normal[pool]
    lit = np.stack([visible(field.scene, sun, position, normal) > 0.1 for sun in directions])
    mixed = pool[lit.any(0) & ~lit.all(0)]
    return np.sort(rng.choice(mixed, min(len(mixed), SUN.dense), replace=False))


def _pool(field: LightField, good: np.ndarray, even: Spots, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Elements of the objects on which something stands out ((k,)), and whether they lie `near` that ((k,) bool)."""
    atlas, outliers = field.atlas, even.stands_out()
    pool = np.flatnonzero(good & np.isin(atlas.object_id, even.sample.object_id[outliers]))
    pool = np.sort(rng.choice(pool, min(len(pool), SAMPLES.in_all), replace=False))

    def key(element: np.ndarray) -> np.ndarray:
        return np.concatenate([atlas.position[element], 100.0 * atlas.object_id[element][:, None]], 1)

    distance, _ = cKDTree(key(even.sample.element[outliers])).query(key(pool), distance_upper_bound=SUN.near)
    return pool, np.isfinite(distance)


@dataclass(frozen=True)
class SolvedSun:
    """A sun, and the spots that tell its strength, with the spread of log albedo over them with and without it.

    Attributes
    ----------
    sun : Sun
    """

    sun: Sun
    _spots: Spots
    _before: float
    _after: float

    def under(self, element: np.ndarray, factor: np.ndarray) -> Sun:
        """The sun again, all other light having changed by factors ((m, 3)) at some elements ((m,))."""
        spots = self._spots
        group = np.concatenate([spots.atlas.object_id[element], spots.sample.object_id])[:, None] * 100.0
        place = np.concatenate([spots.atlas.position[element], spots.position])
        key = np.concatenate([place, group], 1)
        _, nearest = cKDTree(key[: len(element)]).query(key[len(element) :])
        spots.sample = replace(spots.sample, received=spots.sample.received * factor[nearest])
        return _coloured(spots, self.sun.direction, self.sun.radius, self._before, self._after)


def find_sun(
    field: LightField,
    element: np.ndarray,
    received: np.ndarray,
    lamps: list[int],
    good: np.ndarray,
    irradiance: Callable[[np.ndarray], np.ndarray],
    seed: int = 0,
) -> SolvedSun | None:
    """The sun that explains a patch of light best; None where nothing is short of light or no sun explains it.

    Parameters
    ----------
    field : LightField
        With L_d, and the outside as it is known.
    element : (m,) int
        A sample, evenly over the objects.
    received : (m, 3) float64
        E there by all light that is known.
    lamps : list of int
    good : (n,) bool
        Elements that may be asked.
    irradiance : callable
        E by all known light at elements, (k,) int -> (k, 3) float64.
    """
    free = ~np.isin(field.atlas.object_id[element], lamps)
    if free.sum() < LEVELS.few:
        return None
    even = Spots(field, element[free], received[free])
    if even.stands_out().sum() < LEVELS.few:
        return None
    guesses = _on_grid(even, field.environment)
    if not guesses or guesses[0].cost >= even.spread():
        return None
    rng = np.random.default_rng([seed, 3])
    pool, near = _pool(field, good & ~np.isin(field.atlas.object_id, lamps), even, rng)
    chosen = [rng.choice(part, min(len(part), count), replace=False)
              for part, count in ((pool[near], SUN.dense * 2 // 3), (pool[~near], SUN.dense // 3))]  # fmt: skip
    dense = np.sort(np.concatenate(chosen))
    spots = Spots(field, dense, irradiance(dense))
    starts = (spots.explained(guess.direction) for guess in guesses)
    tried = ordered_map(lambda guess: pattern_search(spots.explained, guess, SHARP), starts, 0)
    best, before = min(tried, key=lambda guess: guess.cost), spots.spread()
    if best.cost > (1 - LEVELS.gain) * before:
        return None
    edge_elements = along_edges(field, pool, best.direction, rng)
    if len(edge_elements) < LEVELS.few:
        return None
    edges = Edges(Spots(field, edge_elements, irradiance(edge_elements)))
    fit = min((edges.explained(best.direction, best.strength, r) for r in RADII), key=lambda guess: guess.cost)
    for steps in (SOFT, SOFT[1:]):

        def cost(direction: np.ndarray, current: Guess = fit) -> Guess:
            return edges.explained(direction, current.strength, current.radius)

        fit = pattern_search(cost, fit, steps)
        contribution = spots.contribution(fit.direction, fit.radius)
        strength = spots.strength(contribution)
        fit = min((edges.explained(fit.direction, strength, r) for r in RADII), key=lambda guess: guess.cost)
    contribution = spots.contribution(fit.direction, fit.radius)
    after = spots.spread(contribution, fit.strength)
    short = spots.over() & (contribution > 0)
    still_over = short & spots.over(contribution, fit.strength)
    if (
        fit.cost > (1 - LEVELS.gain) * edges.differ()
        or after > (1 - LEVELS.gain) * before
        or 2 * still_over.sum() > short.sum()
        or not _is_sunlike(spots, contribution)
    ):
        return None
    return SolvedSun(_coloured(spots, fit.direction, fit.radius, before, after), spots, before, after)


def _channels(spots: Spots, contribution: np.ndarray) -> np.ndarray:
    """What each channel says of the sun's irradiance, and the luminance last, (4,)."""
    return np.array([spots.strength(contribution, weights) for weights in (*np.eye(3), LUMINANCE)])


def _is_sunlike(spots: Spots, contribution: np.ndarray) -> bool:
    """Whether no channel is brighter than a sun's can be: in what copper shades throw onto a table red is.

    A channel that is too dark says nothing, as errors of the other light weigh most in it: a bedroom's true sun had .63
    in blue, for .75.
    """
    *channels, luminance = _channels(spots, contribution)
    return bool((np.array(channels) <= luminance * SUN.colour).all())


def of_luminance(strengths: np.ndarray) -> np.ndarray:
    """A sun's irradiance ((3,) float32) by what each channel says of it, held near the luminance, which comes last."""
    *channels, luminance = strengths
    limited = np.clip(channels, luminance / SUN.colour, luminance * SUN.colour)
    return (limited * (luminance / max(float(limited @ LUMINANCE), 1e-12))).astype(np.float32)


def _coloured(spots: Spots, direction: np.ndarray, radius: float, before: float, after: float) -> Sun:
    """The sun with what each channel says of its irradiance, held near the luminance's."""
    light = of_luminance(_channels(spots, spots.contribution(direction, radius)))
    sun = Sun(np.asarray(direction, np.float32), light, radius)
    note = (
        f"A sun that no frame sees was solved from the patch of light that it throws: {sun.where()} "
        f"(spread of log albedo around it {before:.3f} to {after:.3f})."
    )
    return replace(sun, note=note)
