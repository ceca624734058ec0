"""Uncertainty of roughness and specular: 90 % intervals by a delete-group jackknife over an object's elements.

The groups are runs of neighbouring elements (the atlas's order), so that what neighbours share, a piece of texture or
a badly posed frame, is left out together. The jackknife knows nothing of what all elements have in common (error of the
light, of the model): that is the systematic part below.
"""

from dataclasses import dataclass

import numpy as np

from ...brdf.dielectric import MAX_F0
from ...brdf.material import Z90
from ...brdf.model import Constraints
from ...fit.lobe_fit import LobeFit, refitted
from ...fit.problem import DenseProblem, Problem
from .models import Choice
from .params import INTERVALS


@dataclass(frozen=True)
class GlossInterval:
    """90 % intervals (low, high) of Blender's roughness (the square root of phi) and of psi, or a metal's mean F0.

    Both span all that the model allows where nothing is known.
    """

    roughness: tuple[float, float]
    specular: tuple[float, float]


UNKNOWN = GlossInterval((0.0, 1.0), (0.0, MAX_F0))
"""Any roughness, and any dielectric's reflectance."""


def gloss_interval(choice: Choice, problem: Problem | None) -> GlossInterval:
    """The intervals of what was chosen for an object, from the observations that it was fitted to."""
    if not choice.model.has_lobe or choice.fit is None:
        return UNKNOWN
    roughness, specular = float(np.sqrt(choice.fit.phi)), max(float(np.mean(choice.fit.psi)), 1e-4)
    spread, roughness_systematic = (0.0, 0.0), INTERVALS.adopted if choice.looks is None else INTERVALS.by_looks
    if choice.sigmas > 0 and problem is not None and choice.looks is None:
        spread = jackknife(problem, choice.fit, choice.model.constraints)
        roughness_systematic = INTERVALS.roughness_systematic
    width = Z90 * float(np.hypot(spread[0], roughness_systematic))
    systematic = INTERVALS.metal_systematic if choice.model.lobe_alone else INTERVALS.specular_systematic
    factor = float(np.exp(Z90 * np.hypot(min(spread[1] / specular, 1.0), systematic)))
    return GlossInterval(
        (max(roughness - width, 0.0), min(roughness + width, 1.0)), (specular / factor, min(specular * factor, 1.0))
    )


def jackknife(problem: Problem, fit: LobeFit, constraints: Constraints) -> tuple[float, float]:
    """Standard errors of roughness and psi of a fit to a problem, as far as elements differ."""
    dense = DenseProblem(problem)
    count = dense.there.shape[1]
    groups = min(INTERVALS.groups, count // 3)
    if groups < 3:
        return 0.3, 0.3
    group = np.arange(count) * groups // count
    estimates = refitted(dense, fit, constraints, (group != left_out for left_out in range(groups)))
    error = np.sqrt((groups - 1) / groups * np.square(estimates - estimates.mean(0)).sum(0))
    return float(error[0]), float(error[1])
