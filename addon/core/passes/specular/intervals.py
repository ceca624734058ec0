"""How sure roughness and specular are: 90 % intervals by a delete-group jackknife over an object's elements.

The groups are runs of neighbouring elements (the atlas's order), so that what neighbours share, a piece of texture or
a badly posed frame, is left out together. The jackknife knows nothing of what all elements have in common (error of the
light, of the model): that is the systematic part below.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...brdf.dielectric import MOST_F0
from ...brdf.material import Z90
from ...brdf.model import Brdf
from ...fit.lobe_fit import fit_lobe
from ...fit.problem import DenseProblem, Problem
from .models import Choice

GROUPS = 6
ROUGHNESS_SYSTEMATIC = 0.07
"""Standard error of Blender's roughness that all elements share; the grid of phi alone has steps of 0.06. Of 24 glossy
objects in eight rendered rooms (`tests/blender/evidence`) the 90 % intervals then hold 22, in the living room 23 of
23; the jackknife alone says 0.02 in the median where 0.07 is true."""
SPECULAR_SYSTEMATIC = 0.45
"""The same of log psi: 23 of those 24 are held, in the living room 20 of 23; psi came out between 0.6 and 2.2 of the
truth."""
METAL_SYSTEMATIC = 0.15
"""The same of log F0 of metals, measured on five in the living room only (0.89 to 1.15 of the truth)."""
ADOPTED = 0.1
"""Standard error of a roughness that was taken over from another object of the class."""

LOOKS = 0.2
"""The same of one that follows from how the object looks all over (`one_colour`), which is too broad as a rule: 13
metals in three rooms came out -.01 to .25 above the truth (.13 in the root mean square); 3 of 6 in a fourth, rims of
spots mixed with their lamps, .5. These intervals hold 16 of the 19."""


@dataclass(frozen=True)
class GlossInterval:
    """90 % intervals (low, high) of Blender's roughness (the square root of phi) and of psi, or a metal's mean F0.

    Both span all that the model allows where nothing is known.
    """

    roughness: tuple[float, float]
    specular: tuple[float, float]


UNKNOWN = GlossInterval((0.0, 1.0), (0.0, MOST_F0))
"""Any roughness, and any dielectric's reflectance."""


def gloss_interval(choice: Choice, problem: Problem | None) -> GlossInterval:
    """The intervals of what was chosen for an object, from the observations that it was fitted to."""
    if not choice.model.has_lobe or choice.fit is None:
        return UNKNOWN
    roughness, specular = float(np.sqrt(choice.fit.phi)), max(float(np.mean(choice.fit.psi)), 1e-4)
    spread, known = (0.0, 0.0), ADOPTED if choice.looks is None else LOOKS
    if choice.sigmas > 0 and problem is not None and choice.looks is None:
        spread, known = jackknife(problem, choice.model), ROUGHNESS_SYSTEMATIC
    width = Z90 * float(np.hypot(spread[0], known))
    systematic = METAL_SYSTEMATIC if choice.model.lobe_alone else SPECULAR_SYSTEMATIC
    factor = float(np.exp(Z90 * np.hypot(min(spread[1] / specular, 1.0), systematic)))
    return GlossInterval(
        (max(roughness - width, 0.0), min(roughness + width, 1.0)), (specular / factor, min(specular * factor, 1.0))
    )


def jackknife(problem: Problem, model: Brdf) -> tuple[float, float]:
    """Standard errors of roughness and psi of a model's fit, as far as elements differ."""
    dense = DenseProblem(problem)
    count = dense.there.shape[1]
    groups = min(GROUPS, count // 3)
    if groups < 3:
        return 0.3, 0.3
    group = np.arange(count) * groups // count
    fits = [fit_lobe(dense.part(group != left_out), constraints=model.constraints) for left_out in range(groups)]
    found = np.array([(np.sqrt(fit.phi), fit.psi.mean()) for fit in fits])
    error = np.sqrt((groups - 1) / groups * np.square(found - found.mean(0)).sum(0))
    return float(error[0]), float(error[1])
