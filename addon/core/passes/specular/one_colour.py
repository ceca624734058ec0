"""Whether an object looks like a metal or coated all over: diffuse, dielectric and metal compared, each of one colour.

`models` fits what changes with the view while each element has a colour of its own. Thin and small things (taps, legs,
rings) leave it little: few views of few elements, on a mesh coarser than what they mirror. But a metal shows the room,
and everything diffuse the light that arrives: over a whole object of one colour the radiance follows one or the other.
What is compared is the robust spread of log(I / prediction) over all observations; a factor common to all is free, so
none of the three has to know its colour. Texture widens all three spreads alike, and so favours none.

An uncoloured coat over a saturated base shows in the dark channels, too: diffuse and dielectric are compared by channel
(`compare_coat`).
"""

from dataclasses import dataclass

import numpy as np

from ...brdf.dielectric import TYPICAL_F0
from ...fit.lobe_fit import robust_scale
from ...fit.problem import Problem
from ...luminance import LUMINANCE
from ...significance import LEVELS
from .params import FIT


@dataclass(frozen=True)
class OneColour:
    """How well one colour explains an object's frames, as a metal (`compare`) or under a coat (`compare_coat`).

    Attributes
    ----------
    diffuse, other, spread : float
        Robust standard deviation of log(I / prediction): of a diffuse surface; of the best that a lobe is compared
        with, which for a metal may be a dielectric; and with the lobe.
    phi : float
        Width of the lobe.
    sigmas : float
        By how many standard errors over the elements the lobe explains more.
    """

    diffuse: float
    other: float
    spread: float
    phi: float
    sigmas: float

    @property
    def ratio(self) -> float:
        """The spread with the lobe over the best without; below 1 favours it."""
        return self.spread / self.other


def compare(problem: Problem, irradiance: np.ndarray) -> OneColour | None:
    """Compare diffuse, dielectric and metal on an object's observations; None where there are too few.

    Parameters
    ----------
    irradiance : (n, 3) float32
        E of each element of the surface.
    """
    observations = _usable(problem, irradiance)
    if observations is None:
        return None
    usable, radiance, E, element = observations
    light, log_I = problem.light, np.log(radiance @ LUMINANCE)
    widths = np.flatnonzero(light.grid <= FIT.broadest_phi)

    def residual(predicted: np.ndarray) -> np.ndarray:
        """log(I / predicted) about its median, (k,)."""
        log_ratio = log_I - np.log(np.maximum(predicted, 1e-3 * np.median(predicted) + 1e-12))
        return log_ratio - np.median(log_ratio)

    diffuse = residual(E @ LUMINANCE)
    coats = (_one_colour(radiance, E, _coat(problem, at)[usable]) for at in widths)
    dielectric = min((residual(predicted @ LUMINANCE) for predicted in coats), key=spread)
    metals = [residual(light.A[usable, at] @ LUMINANCE) for at in widths]
    return _compared(diffuse, min(diffuse, dielectric, key=spread), metals, light.grid[widths], element)


def compare_coat(problem: Problem, irradiance: np.ndarray) -> OneColour | None:
    """Compare diffuse and coated on an object's observations, by channel; parameters and None as in `compare`."""
    observations = _usable(problem, irradiance)
    if observations is None:
        return None
    usable, radiance, E, element = observations
    widths = np.flatnonzero(problem.light.grid <= FIT.broadest_phi)
    floor = LEVELS.dark * np.median(radiance)

    def residual(predicted: np.ndarray) -> np.ndarray:
        """log(I / predicted), (k, 3); a factor common to all channels is free."""
        log_ratio = np.log(np.maximum(radiance, floor) / np.maximum(predicted, floor))
        return log_ratio - np.median(log_ratio.mean(1))

    diffuse = residual(_one_colour(radiance, E, np.zeros(1, np.float32)))
    coats = [residual(_one_colour(radiance, E, _coat(problem, at)[usable])) for at in widths]
    return _compared(diffuse, diffuse, coats, problem.light.grid[widths], element)


def _compared(
    diffuse: np.ndarray, other: np.ndarray, by_width: list[np.ndarray], phi: np.ndarray, element: np.ndarray
) -> OneColour:
    """The lobe that leaves the least residuals, of one of each width `phi`, against what others leave."""
    spreads = [spread(residual) for residual in by_width]
    best = int(np.argmin(spreads))
    sigmas = _sigmas(by_width[best], other, element)
    return OneColour(spread(diffuse), spread(other), spreads[best], float(phi[best]), sigmas)


def _usable(problem: Problem, irradiance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
    """Which observations are usable, (m,) bool, and their radiance, E (k, 3) and element (k,); None if too few."""
    bright, E = problem.radiance @ LUMINANCE, irradiance[problem.element]
    usable = (bright > 1e-3 * np.median(bright)) & (E @ LUMINANCE > 0)
    if usable.sum() < LEVELS.enough:
        return None
    return usable, problem.radiance[usable], E[usable], problem.element[usable]


def _coat(problem: Problem, at: int) -> np.ndarray:
    """Radiance (m, 3) of a dielectric's lobe, of the width at index `at` of the grid."""
    return TYPICAL_F0 * problem.light.A[:, at] + problem.light.B[:, at]


def _one_colour(radiance: np.ndarray, E: np.ndarray, coat: np.ndarray) -> np.ndarray:
    """Radiance (k, 3) of the one albedo under a coat that suits most observations."""
    rho = np.clip(np.median(np.pi * (radiance - coat) / np.maximum(E, 1e-9), 0), 0, 1)
    return rho * E / np.pi + coat


def _sigmas(residual: np.ndarray, reference: np.ndarray, element: np.ndarray) -> float:
    """By how many standard errors over the elements `residual` ((k,) or (k, 3)) is smaller than `reference`."""
    limit = LEVELS.sigmas * spread(reference)
    saved = np.minimum(np.abs(reference), limit) - np.minimum(np.abs(residual), limit)
    _, group, count = np.unique(element, return_inverse=True, return_counts=True)
    by_element = np.bincount(group, saved.reshape(len(element), -1).mean(1)) / count
    error = by_element.std() / np.sqrt(len(by_element))
    return float(by_element.mean() / max(error, 1e-12))


def spread(residual: np.ndarray) -> float:
    """Robust standard deviation of residuals about 0."""
    return robust_scale(np.abs(residual).ravel())
