"""Whether an object looks like a metal all over: matt, dielectric and metal compared, each of one colour.

`models` asks what changes with the view while each element has a colour of its own. Thin and small things (taps, legs,
rings) leave it little: few views of few elements, on a mesh coarser than what they mirror. But a metal shows the room,
and everything matt the light that arrives: over a whole object of one colour the radiance follows one or the other.
What is compared is the robust spread of log(I / prediction) over all observations; a factor common to all is free, so
none of the three has to know its colour. Texture widens all three spreads alike, and so speaks for none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..shading.emitters import LUMINANCE
from .fit import robust_scale
from .layout import Problem

DIELECTRIC_PSI = 0.04
"""What a dielectric of one colour reflects at normal incidence (n = 1.5)."""
BROADEST_PHI = 0.5
"""A lobe broader than this, of a metal or over a diffuse part, can't be told from a diffuse surface."""
LEAST_OBSERVATIONS = 40
TRIMMED = 3.0
"""Residuals count up to so many spreads."""


@dataclass(frozen=True)
class OneColour:
    """How well each kind of matter of one colour explains an object's frames.

    Attributes
    ----------
    matt, dielectric, metal : float
        Robust standard deviation of log(I / prediction).
    phi : float
        Width of the metal's lobe.
    sigmas : float
        By how many standard errors over the elements the metal explains more than the better of the others.
    """

    matt: float
    dielectric: float
    metal: float
    phi: float
    sigmas: float

    @property
    def other(self) -> float:
        """Spread of the better one of the others."""
        return min(self.matt, self.dielectric)

    @property
    def ratio(self) -> float:
        """The metal's spread over that; below 1 speaks for metal."""
        return self.metal / self.other


def compare(problem: Problem, irradiance: np.ndarray) -> OneColour | None:
    """Compare the three on an object's observations; None where there are too few.

    Parameters
    ----------
    problem : Problem
    irradiance : (n, 3) float32
        E of each element of the surface.
    """
    seen, E = problem.radiance @ LUMINANCE, irradiance[problem.element]
    usable = (seen > 1e-3 * np.median(seen)) & (E @ LUMINANCE > 0)
    if usable.sum() < LEAST_OBSERVATIONS:
        return None
    log_I, element = np.log(seen[usable]), problem.element[usable]
    light = problem.light
    widths = np.flatnonzero(light.grid <= BROADEST_PHI)

    def residual(predicted: np.ndarray) -> np.ndarray:
        """log(I / predicted) about its median, (k,), of predictions for all (m,)."""
        rest = log_I - np.log(np.maximum(predicted[usable], 1e-3 * np.median(predicted[usable]) + 1e-12))
        return rest - np.median(rest)

    def with_coat(at: int) -> np.ndarray:
        """Radiance (m,) of a dielectric, of the albedo that suits most observations."""
        coat = DIELECTRIC_PSI * light.A[:, at] + light.B[:, at]
        rho = np.clip(np.median(np.pi * (problem.radiance - coat) / np.maximum(E, 1e-9), 0), 0, 1)
        return (rho * E / np.pi + coat) @ LUMINANCE

    matt = residual(E @ LUMINANCE)
    dielectric = min((residual(with_coat(at)) for at in widths), key=spread)
    metals = [residual(light.A[:, at] @ LUMINANCE) for at in widths]
    best = int(np.argmin([spread(rest) for rest in metals]))
    other, metal = min(matt, dielectric, key=spread), metals[best]
    most = TRIMMED * spread(other)
    saved = np.minimum(np.abs(other), most) - np.minimum(np.abs(metal), most)
    _, group, count = np.unique(element, return_inverse=True, return_counts=True)
    by_element = np.bincount(group, saved) / count
    error = by_element.std() / np.sqrt(len(by_element))
    return OneColour(
        spread(matt), spread(dielectric), spread(metal), float(light.grid[widths[best]]),
        float(by_element.mean() / max(error, 1e-12)),
    )  # fmt: skip


def spread(residual: np.ndarray) -> float:
    """Robust standard deviation of residuals about 0."""
    return robust_scale(np.abs(residual))
