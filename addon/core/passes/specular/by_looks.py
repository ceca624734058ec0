"""Metal or coated by appearance: an object's whole surface decides where the views of its elements say too little.

Taps, legs and rings, soap and black tubes: too small, thin or seldom seen for a lobe to show from view to view.
`one_colour` compares the models that could explain all of such an object; here is when one of them is accepted.
"""

from dataclasses import replace

import numpy as np

from ...brdf.dielectric import DIELECTRIC, MAX_F0, TYPICAL_F0
from ...brdf.metal import METAL
from ...fit.lobe_fit import LobeFit
from ...fit.params import LOBE_FIT
from ...fit.problem import Problem
from ...significance import LEVELS, SIGMA_OF_MAD
from .models import Choice, metal_f0, reflectance
from .one_colour import OneColour
from .params import LOOKS


def metal_by_looks(choice: Choice, looks: OneColour, problem: Problem) -> Choice:
    """An object's choice, METAL where one metal explains all of its surface and neither diffuse nor dielectric does.

    For small and thin objects: `problem` may hold elements of a single view. They are taken to be of one colour; where
    they are not, texture widens all spreads and the choice stays.
    """
    if looks.other < LOOKS.metal_spread or looks.ratio > LOOKS.ratio:
        return choice
    # No metal is that dark in any channel: gold has .3 in blue, reddish wood had .06. None reflects more than it
    # receives, but for the light's error: a white bowl under a lamp had 2.1.
    if not MAX_F0 < reflectance(problem, looks.phi).min() <= 1 + LOBE_FIT.light_error:
        return choice
    fit = _fit(looks, metal_f0(problem, looks.phi))
    if looks.sigmas < LEVELS.sigmas:
        return replace(choice, metal=choice.metal or fit)
    note = (
        f"Its radiance spreads by {looks.spread:.2f} about a metal's, by {looks.other:.2f} about that of anything else "
        "of one colour."
    )
    return replace(choice, model=METAL, fit=fit, gain=1 - looks.ratio, sigmas=looks.sigmas, note=note, looks=looks)


def coated_by_looks(choice: Choice, looks: OneColour) -> Choice:
    """A Lambertian object's choice, DIELECTRIC where one colour under a coat explains all of its surface far better."""
    min_diffuse, max_coated = LOOKS.coated_spread
    if looks.diffuse < min_diffuse or looks.spread > max_coated:
        return choice
    if looks.ratio > LOOKS.ratio or looks.sigmas < LEVELS.sigmas:
        return choice
    fit = _fit(looks, np.full(3, TYPICAL_F0))
    note = (
        f"Its radiance spreads by {looks.spread:.2f} about that of one colour under a coat, by {looks.diffuse:.2f} "
        "about a diffuse one's."
    )
    return replace(choice, model=DIELECTRIC, fit=fit, gain=1 - looks.ratio, sigmas=looks.sigmas, note=note, looks=looks)


def _fit(looks: OneColour, psi: np.ndarray) -> LobeFit:
    """The lobe as a fit; its residuals are median sizes, as `LobeFit` has them."""
    return LobeFit(looks.phi, psi, 0.0, 0.0, looks.spread / SIGMA_OF_MAD, looks.diffuse / SIGMA_OF_MAD)
