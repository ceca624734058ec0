"""Which model an object needs: Lambertian, a dielectric lobe over diffuse, or metal. Never richer than the data show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..material import LAMBERTIAN, METAL, SPECULAR
from .fit import LobeFit, Problem, element_costs, fit_lobe, robust_scale
from .lobes import LobeLight

LEAST_PSI = 0.02
"""No solid dielectric reflects less at normal incidence (n = 1.33); a smaller fitted psi is no lobe at all."""
METAL_PSI = 0.12
"""No common dielectric reflects more (n = 2.06); what does is a metal or a mirror."""
MIN_GAIN = 0.02
MIN_SIGMAS = 3.0
"""A lobe must lower the cost on elements that its fit has not seen by this share, and by this many standard errors."""
MIN_ELEMENTS = 12


@dataclass(frozen=True)
class Choice:
    """The model taken for one object.

    Attributes
    ----------
    model : str
        LAMBERTIAN, SPECULAR or METAL.
    fit : LobeFit or None
        The best lobe, also where it was not taken; None if there was too little to fit.
    gain : float
        Share of the cost that the lobe takes away on held-out elements.
    sigmas : float
        The same in standard errors.
    note : str
    """

    model: str
    fit: LobeFit | None
    gain: float = 0.0
    sigmas: float = 0.0
    note: str = ""


def part(problem: Problem, chosen: np.ndarray) -> Problem:
    """The observations `chosen` ((m,) bool) of a problem."""
    light = problem.light
    return Problem(
        problem.element[chosen], problem.radiance[chosen], problem.lit_diffuse[chosen],
        LobeLight(light.A[chosen], light.B[chosen], light.mirror[chosen]),
    )  # fmt: skip


def _held_out(problem: Problem, coloured: bool) -> tuple[float, float]:
    """Gain of a lobe over none on the elements that each half's fit has not seen, and its standard errors."""
    elements, group = np.unique(problem.element, return_inverse=True)
    odd = (np.random.default_rng(0).permutation(len(elements)) % 2).astype(bool)[group]
    with_lobe, without = [], []
    for train, test in ((odd, ~odd), (~odd, odd)):
        fit = fit_lobe(part(problem, train), "frames", coloured, LEAST_PSI)
        held = part(problem, test)
        scale = robust_scale(np.sqrt(2) * np.float64([fit.residual]))
        with_lobe.append(element_costs(held, fit, scale))
        without.append(element_costs(held, None, scale))
    a, b = np.concatenate(with_lobe), np.concatenate(without)
    saved = b - a
    error = saved.std() / np.sqrt(len(saved))
    return float(saved.sum() / max(b.sum(), 1e-30)), float(saved.mean() / max(error, 1e-30))


def choose_model(problem: Problem) -> Choice:
    """The simplest model that the observations support, by two-fold cross-validation over the elements."""
    if len(np.unique(problem.element)) < MIN_ELEMENTS:
        return Choice(LAMBERTIAN, None, note="Too few observations to look for a highlight.")
    metal = fit_lobe(problem, "frames", True)
    if float(metal.psi.mean()) > METAL_PSI:
        gain, sigmas = _held_out(problem, True)
        if gain > MIN_GAIN and sigmas > MIN_SIGMAS:
            return Choice(METAL, metal, gain, sigmas)
    fit = fit_lobe(problem, "frames", False, LEAST_PSI)
    gain, sigmas = _held_out(problem, False)
    if gain > MIN_GAIN and sigmas > MIN_SIGMAS:
        note = "" if fit.psi[0] < METAL_PSI else "Reflects more than a common dielectric, but no metal was identified."
        return Choice(SPECULAR, fit, gain, sigmas, note)
    return Choice(LAMBERTIAN, fit, gain, sigmas, "Roughness and specular are not identifiable from these frames.")


def metal_f0(problem: Problem, phi_index: int) -> np.ndarray:
    """F0 of a metal, (3,): all its light is the lobe's, so I = F0 A + B; the median ratio over the observations."""
    A = problem.light.A[:, phi_index].astype(np.float64)
    B = problem.light.B[:, phi_index].astype(np.float64)
    strong = A.mean(1) >= np.median(A.mean(1)) * 0.5
    ratio = (problem.radiance[strong] - B[strong]) / np.maximum(A[strong], 1e-9)
    return np.clip(np.median(ratio, 0), 0.02, 1.0)
