"""A second colour around a place: the joints between tiles, stripes on a ground, letters on a page.

A median and a width say nothing of a colour that covers a tenth of the neighbourhood: what bears it is shrunk towards
the others as far as it is uncertain. Where more neighbours lie far from the median than noise explains, each of those
is a value that an element may have too. The prior is then a mixture of the neighbourhood's normal distribution and of
narrow ones at these neighbours (an empirical prior, Robbins 1956); the albedo is its mean once the element is measured.
"""

from typing import NamedTuple

import numpy as np

from ...kinds import Block
from ...parallel import for_blocks
from ...significance import LEVELS
from .params import MAX_ALBEDO, PRIOR, SECOND_COLOUR

BLOCK: Block[int] = 1 << 11


class Neighbourhood(NamedTuple):
    """What is around m places: log albedo's median (m, 3) and width (m,), and the neighbours themselves, (m, k) int."""

    median: np.ndarray
    width: np.ndarray
    neighbours: np.ndarray


def shrunk_to_second_colour(
    shrunk: np.ndarray,
    rho: np.ndarray,
    error: np.ndarray,
    prior: Neighbourhood,
    cell: np.ndarray,
    reference: np.ndarray,
    reference_error: np.ndarray,
) -> np.ndarray:
    """Log albedo of measured elements ((m, 3)), shrunk to the other colours around them as far as those are likelier.

    Measured with it (score by `scripts/qa_rooms`, dB): bathrooms +.36 and +.45, a hall +.36, other rooms +.0 to +.05,
    the living room -.10.

    Parameters
    ----------
    shrunk : (m, 3)
        Log albedo, shrunk to the middle of its neighbourhood.
    rho : (m, 3)
        As measured; above 0.
    error : (m,)
        Its relative standard error.
    prior : Neighbourhood
        Of cells; neighbours are rows of `reference`.
    cell : (m,) int
        Each element's cell.
    reference, reference_error : (r, 3) and (r,)
        Albedo above 0, and relative standard error.
    """
    ground, width, neighbours = np.exp(prior.median), prior.width, prior.neighbours
    other = np.empty(neighbours.shape, bool)
    # Where a reference was cut off E is wrong; an error may be as large as a float holds. Such tell no colour.
    unclamped, tolerance = reference.max(1) < MAX_ALBEDO, np.square(LEVELS.likely * reference_error, dtype=np.float64)

    def mark(part: slice) -> None:
        index = neighbours[part]
        limit = (LEVELS.likely * width[part, None]) ** 2 + tolerance[index]
        other[part] = (_squared_difference(reference[index], ground[part, None]) > limit) & unclamped[index]

    for_blocks(mark, len(neighbours), BLOCK, 0)
    share = other.mean(1)
    real = np.clip(1 - SECOND_COLOUR.by_chance / np.maximum(share, 1e-9), 0, 1)
    result, log_reference = shrunk.copy(), np.log(reference)
    todo = np.flatnonzero(real[cell] > 0)

    def draw(part: slice) -> None:
        elements = todo[part]
        at = cell[elements]
        index, value = neighbours[at], rho[elements]
        local = (PRIOR.own * error[elements]) ** 2
        of_ground = (1 - real[at] * share[at]) * _normal_density(
            _squared_difference(value, ground[at]), local + width[at] ** 2
        )
        distance = _squared_difference(value[:, None], reference[index])
        of_other = (
            (real[at] / neighbours.shape[1])[:, None]
            * other[at]
            * _normal_density(distance, (local + SECOND_COLOUR.apart**2)[:, None])
        )
        of_ground += SECOND_COLOUR.unexplained
        total = of_ground + of_other.sum(1)
        drawn = np.einsum("mk,mkc->mc", of_other, log_reference[index])
        trust = (SECOND_COLOUR.apart**2 / (SECOND_COLOUR.apart**2 + local))[:, None]
        as_other = trust * of_other.sum(1)[:, None] * np.log(value) + (1 - trust) * drawn
        result[elements] = (of_ground[:, None] * shrunk[elements] + as_other) / total[:, None]

    for_blocks(draw, len(todo), BLOCK, 0)
    return result


def _squared_difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Squared relative difference of two colours: that of their lengths where they are of one hue."""
    return _squared_length(a - b) / np.sqrt(_squared_length(a) * _squared_length(b))


def _squared_length(a: np.ndarray) -> np.ndarray:
    return np.einsum("...c,...c", a, a)


def _normal_density(square: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Density of a normal distribution at a squared distance, but for a factor."""
    return np.exp(-0.5 * square / variance) / np.sqrt(variance)
