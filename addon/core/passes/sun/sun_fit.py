"""A sun that no frame saw, found by the edges of the patches of light that it throws through openings.

A direction says where its patches lie, hence it is looked for among all directions. The candidates are those that light
what seems to reflect more than it gets, and light it brightest beside what they leave in shade. Around the edges of
each candidate's patches, many elements tell direction, disc and strength: under the right sun neighbours on both sides
are alike. Texture, paper and lamplight are bright too, but no direction puts its patch right over them. Of what the
sensor clipped only a lower bound is known, which is enough (`Edges`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from ...light.field import LightField
from ...light.sun import Sun
from ...luminance import LUMINANCE
from ...parallel import ordered_map
from ...scene.params import SAMPLES
from ...scene.sphere import fibonacci
from ...significance import LEVELS
from .params import SUN
from .sun_spots import RADII, Edges, Guess, Spots, ring, visible

GRID = float(np.radians(4.0))
RINGS = np.radians([1.0, 2.0, 3.0])
"""Around a direction of the grid, with a point-like sun: as far as to the corners of its cell."""
SHARP = np.radians([0.5])
"""Steps from the best of these."""
ASTRAY = float(np.radians(2.5))
SOFT = np.radians([0.8, 0.4, 0.2])


def _candidates(even: Spots, wide: Edges) -> list[Guess]:
    """Directions that may be the sun's, the best first: of those that reach what stands out on the `even` sample."""
    directions = _reaching_most(even, even.stands_out())
    guesses = list(ordered_map(wide.contrast, directions, 0))
    # A patch may be narrower than the grid is wide, and the guess beside the sun then no better than any other.
    refined = ordered_map(lambda guess: _within_cell(wide.contrast, guess), _distinct(guesses)[: SUN.refined], 0)
    return _distinct(list(refined))[: SUN.tried]


def _within_cell(cost: Callable[[np.ndarray], Guess], guess: Guess) -> Guess:
    """The direction of least cost in a cell of the grid: every degree first, as bars of a window make minima."""
    directions = (d for k, radius in enumerate(RINGS, 1) for d in ring(guess.direction, radius, 6 * k) if d[2] > 0)
    best = min((guess, *map(cost, directions)), key=lambda candidate: candidate.cost)
    return _pattern_search(cost, best, SHARP)


def _reaching_most(spots: Spots, chosen: np.ndarray) -> np.ndarray:
    """Directions above the horizon, of the grid, that reach more of the spots `chosen` ((m,) bool) than of the others.

    (d, 3) float32, the best first. By a wide opening many directions reach all alike. Also where frames show a sky
    without a sun: a renderer's is seen by no camera, and what it lights tells enough.
    """
    directions = fibonacci(int(4 * np.pi / GRID**2)).astype(np.float32)
    directions = directions[directions[:, 2] > 0]

    def reached(index: np.ndarray) -> np.ndarray:
        spot, ray = np.nonzero(spots.normal[index] @ directions.T > 0)
        origin = spots.scene.off_surface(spots.position[index], spots.normal[index])
        occluded = spots.scene.occluded(origin[spot], directions[ray], np.full(len(spot), np.inf, np.float32))
        return np.bincount(ray[~occluded], minlength=len(directions)) / max(len(index), 1)

    of_chosen, others = reached(np.flatnonzero(chosen)), np.flatnonzero(~chosen)
    some = np.random.default_rng(0).choice(others, min(len(others), int(chosen.sum())), replace=False)
    best = np.argsort(reached(some) - of_chosen, kind="stable")[: SUN.kept]
    return directions[best[of_chosen[best] > SUN.reached]]


def _distinct(guesses: list[Guess]) -> list[Guess]:
    """The guesses that have none better within 1.5 `GRID`, the best first."""
    chosen: list[Guess] = []
    for guess in sorted(guesses, key=lambda guess: guess.cost):
        if all(guess.direction @ better.direction < np.cos(1.5 * GRID) for better in chosen):
            chosen.append(guess)
    return chosen


def _pattern_search(cost: Callable[[np.ndarray], Guess], guess: Guess, steps: np.ndarray) -> Guess:
    """The direction of least cost near a guess: the best of eight neighbours, again and again, by smaller steps.

    It stays above the horizon.
    """
    for step in steps:
        for _ in range(4):
            directions = (direction for direction in ring(guess.direction, step) if direction[2] > 0)
            new = min(map(cost, directions), key=lambda candidate: candidate.cost, default=guess)
            if new.cost >= guess.cost:
                break
            guess = new
    return guess


def along_edges(field: LightField, pool: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Elements of the `pool` that the direction, or one within `ASTRAY` of it, leaves lit and another does not."""
    directions = (direction, *ring(direction, ASTRAY), *ring(direction, ASTRAY / 2, 4))
    position, normal = field.atlas.position[pool], field.atlas.normal[pool]
    lit = np.stack([visible(field.scene, sun, position, normal) > 0.1 for sun in directions])
    return pool[lit.any(0) & ~lit.all(0)]


@dataclass(frozen=True)
class SolvedSun:
    """A sun, the sample that it was found with, and its edges."""

    sun: Sun
    _even: Spots
    _edges: Edges

    @property
    def measured(self) -> np.ndarray:
        """Channels whose strength is known though what it lights is clipped in others, (3,) bool."""
        return self._edges.measured(self.sun.direction)

    def times(self, factor: np.ndarray) -> Sun:
        """The sun so many times as bright ((3,)), of a colour that a sun can have."""
        irradiance = self.sun.irradiance * factor
        return replace(self.sun, irradiance=of_luminance(np.append(irradiance, irradiance @ LUMINANCE)))

    def under(self, factor: np.ndarray) -> Sun:
        """The sun again, all other light having changed by factors ((m, 3)) at the sample that it was found with."""
        spots = self._edges.spots
        _, nearest = cKDTree(self._even.place).query(spots.place)
        spots.sample = replace(spots.sample, received=spots.sample.received * factor[nearest])
        strengths = self._edges.strengths(self.sun.direction)
        return replace(self.sun, irradiance=of_luminance(strengths))


def find_sun(
    field: LightField,
    element: np.ndarray,
    received: np.ndarray,
    good: np.ndarray,
    irradiance: Callable[[np.ndarray], np.ndarray],
    object_id: np.ndarray,
    lower: np.ndarray,
    seed: int = 0,
) -> SolvedSun | None:
    """The sun that explains a patch of light best; None where nothing is short of light or no sun explains it.

    Parameters
    ----------
    field : LightField
        With L_d, of clipped elements the level at which they are, and the outside as it is known.
    element : (m,) int
        A sample, evenly over the objects.
    received : (m, 3) float64
        E there by all light that is known.
    good : (n,) bool
        Elements that may be asked.
    irradiance : callable
        E by all known light at elements, (k,) int -> (k, 3) float64.
    object_id, lower : (n,) int, (n, 3) bool
        The object of each element, and which channels of its radiance are lower bounds.
    """

    def spots(elements: np.ndarray, E: np.ndarray) -> Spots:
        return Spots(field, elements, E, object_id, lower)

    if len(element) < LEVELS.few:
        return None
    even = spots(element, received)
    outliers = even.stands_out()
    if outliers.sum() < LEVELS.few:
        return None
    rng = np.random.default_rng([seed, 3])
    pool = np.flatnonzero(good & np.isin(object_id, even.sample.object_id[outliers]))
    pool = np.sort(rng.choice(pool, min(len(pool), SAMPLES.in_all), replace=False))
    sample = np.sort(rng.choice(pool, min(len(pool), SUN.even), replace=False))
    wide = Edges(spots(sample, np.ones((len(sample), 3))))
    for guess in _candidates(even, wide):
        beside = along_edges(field, pool, guess.direction)
        beside = np.sort(rng.choice(beside, min(len(beside), SUN.dense), replace=False))
        if len(beside) < LEVELS.few:
            continue
        edges = Edges(spots(beside, irradiance(beside)))
        fit = _fit(edges, guess.direction)
        lit = edges.spots.contribution(fit.direction, fit.radius)
        short = edges.spots.over() & (lit > 0)
        explained = short & ~edges.spots.over(lit, fit.strength)
        strengths = edges.strengths(fit.direction)
        # Paper in reach of a window differs across the edge of such a patch, but its own edges lie elsewhere.
        before, after = edges.across(fit)
        alike = after < (1 - SUN.gain) * before and fit.cost < (1 - SUN.along) * edges.without_sun()
        if not alike and explained.sum() >= LEVELS.few:
            # Albedo does not explain it. A fused mesh's shadows lie a little off: light and shade are told off them.
            before, after = edges.off_edge(fit)
            alike = after < (1 - SUN.off_edge) * before
        raised = edges.spots.raised(lit, fit.strength) > SUN.raised
        if alike and raised and 2 * explained.sum() >= short.sum() and is_sunlike(strengths):
            direction = np.asarray(fit.direction, np.float32)
            return SolvedSun(Sun(direction, of_luminance(strengths), fit.radius, edges=(before, after)), even, edges)
    return None


def _fit(edges: Edges, direction: np.ndarray) -> Guess:
    """The sun near the direction under which neighbours along the edges are most alike."""

    def solved(direction: np.ndarray) -> Guess:
        strength = edges.strengths(direction)[-1]
        return min((edges.explained(direction, strength, r) for r in RADII), key=lambda guess: guess.cost)

    fit = solved(direction)
    for steps in (SOFT, SOFT[1:]):
        cost = partial(edges.explained, strength=fit.strength, radius=fit.radius)
        fit = solved(_pattern_search(cost, fit, steps).direction)
    return fit


def is_sunlike(strengths: np.ndarray) -> bool:
    """Whether no channel is brighter than a sun's can be: in what copper shades throw onto a table red is.

    A channel that is too dark says nothing, as errors of the other light weigh most in it: a bedroom's true sun had .63
    in blue, for .75.
    """
    *channels, luminance = strengths
    return bool((np.array(channels) <= luminance * SUN.colour).all())


def of_luminance(strengths: np.ndarray) -> np.ndarray:
    """A sun's irradiance ((3,) float32) by what each channel says of it, held near the luminance, which comes last."""
    *channels, luminance = strengths
    limited = np.clip(channels, luminance / SUN.colour, luminance * SUN.colour)
    return (limited * (luminance / max(float(limited @ LUMINANCE), 1e-12))).astype(np.float32)
