"""Metal or coated by its looks: what an object's whole surface says where the views of its elements say too little.

Taps, legs and rings, soap and black tubes: too small, thin or seldom seen for a lobe to be told from view to view.
`one_colour` compares what could explain all of such an object; here is what it takes to believe it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...brdf.dielectric import DIELECTRIC, MOST_F0, USUAL_F0
from ...brdf.metal import METAL
from ...fit.lobe_fit import LobeFit
from ...fit.problem import Problem
from .models import Choice, metal_f0
from .one_colour import Coated, OneColour

LOOKS, LOOKS_SIGMAS = 0.9, 3.0
"""An object of one colour is metal if that leaves less than this share of the spread that matt and dielectric leave, by
this many standard errors. Of 166 objects in the living room and five others, metals had 0.2 to 1.1 (the half of them
below 0.8), everything else 0.92 and more, but for what `LOOKS_SPREAD` leaves out and a pane of glass (0.58); reddish
wood in a perturbed scan had 0.78 and an F0 that no metal has (`metal_by_looks`)."""
LIKELY_SIGMAS = 1.5
"""With so many it is metal if others of its class are."""
LOOKS_SPREAD = 0.15
"""What follows matt light as closely as this says nothing against it: errors of E and A are of that size."""
COATED, COATED_SIGMAS = 0.9, 4.0
"""An object of one colour is coated if that leaves less than this share of the spread that matt leaves, by this many
standard errors. Of what was called Lambertian in six rooms and two perturbed scans, fourteen coated things had less
(black tubes 0.42, a hand rail 0.74, soap 0.75, a plant pot 0.89); what is truly matt had 0.94 and more, but for what
`COATED_SPREAD` says."""
COATED_SPREAD = (0.1, 0.37)
"""What follows matt light as closely as the first says nothing against it (a bath mat: 0.04); what does not follow
coated light to the second is not explained (a cord as thick as a pixel: 0.65 matt, 0.40 coated; of a table 0.35)."""


def metal_by_looks(choice: Choice, looks: OneColour, problem: Problem) -> Choice:
    """An object's choice, METAL where one metal explains all of its surface and neither matt nor dielectric does.

    For things that are small and thin: `problem` may hold elements of a single view. They are taken to be of one
    colour; where they are not, texture widens all spreads and the choice stays.
    """
    if looks.other < LOOKS_SPREAD or looks.ratio > LOOKS or looks.sigmas < LIKELY_SIGMAS:
        return choice
    f0 = metal_f0(problem, looks.phi)
    if f0.min() <= MOST_F0:  # no metal is that dark in any channel, gold has .3 in blue; reddish wood had .06
        return choice
    fit = _fit(looks.phi, f0, looks.metal, looks.matt)
    if looks.sigmas < LOOKS_SIGMAS:
        return replace(choice, metal=choice.metal or fit)
    note = (
        f"Its radiance spreads by {looks.metal:.2f} about a metal's, by {looks.other:.2f} about that of anything else "
        "of one colour."
    )
    return replace(choice, model=METAL, fit=fit, gain=1 - looks.ratio, sigmas=looks.sigmas, note=note, looks=looks)


def coated_by_looks(choice: Choice, looks: Coated) -> Choice:
    """A Lambertian object's choice, DIELECTRIC where one colour under a coat explains all of its surface far better."""
    least, most = COATED_SPREAD
    if looks.matt < least or looks.coated > most or looks.ratio > COATED or looks.sigmas < COATED_SIGMAS:
        return choice
    fit = _fit(looks.phi, np.full(3, USUAL_F0), looks.coated, looks.matt)
    note = (
        f"Its radiance spreads by {looks.coated:.2f} about that of one colour under a coat, by {looks.matt:.2f} about "
        "a matt one's."
    )
    return replace(choice, model=DIELECTRIC, fit=fit, gain=1 - looks.ratio, sigmas=looks.sigmas, note=note, looks=looks)


def _fit(phi: float, psi: np.ndarray, spread: float, matt: float) -> LobeFit:
    """The lobe as a fit; its residuals are median sizes, as `LobeFit` has them."""
    residual, without = spread / 1.4826, matt / 1.4826
    return LobeFit(phi, psi, 0.0, 0.0, residual**2, without**2, residual, without)
