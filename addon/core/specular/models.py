"""Which model an object needs: Lambertian, a dielectric lobe over diffuse, or metal; none richer than the data show."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..material import LAMBERTIAN, METAL, SPECULAR
from .fit import LobeFit, Problem, element_costs, fit_lobe

LEAST_PSI = 0.02
"""No solid dielectric reflects less at normal incidence (n = 1.33); a smaller fitted psi is no lobe at all."""
METAL_PSI = 0.12
"""No common dielectric reflects more (n = 2.06); what does is a metal or a mirror."""
METAL_PHI = 0.5
DIELECTRIC_PHI = 0.7
"""A lobe broader than this, of a metal or over a diffuse part, can't be told from a diffuse surface."""
MIN_GAIN = 0.02
MIN_SIGMAS = 3.0
"""A lobe must lower the cost on elements that its fit has not seen by this share, and by this many standard errors."""
MIN_ELEMENTS = 12
EXCLUDED = 0.1
"""Rise of an object's cost from which on the lobe of its class is refused."""


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


def gain_of(fit: LobeFit, held: Problem) -> tuple[float, float]:
    """Share of the cost that a fit's lobe takes off elements it has not seen, and that in standard errors."""
    scale = max(1.4826 * fit.residual, 1e-4)
    with_lobe, without = element_costs(held, fit, True, scale), element_costs(held, fit, False, scale)
    saved = without - with_lobe
    error = saved.std() / np.sqrt(len(saved))
    return float(saved.sum() / max(without.sum(), 1e-30)), float(saved.mean() / max(error, 1e-30))


def _held_out(problem: Problem, coloured: bool) -> tuple[float, float]:
    """`gain_of` by two-fold cross-validation over the elements."""
    elements, group = np.unique(problem.element, return_inverse=True)
    odd = (np.random.default_rng(0).permutation(len(elements)) % 2).astype(bool)[group]
    found = [
        gain_of(fit_lobe(problem.part(train), "frames", coloured, LEAST_PSI), problem.part(~train))
        for train in (odd, ~odd)
    ]
    gain, sigmas = np.mean(found, 0)
    return float(gain), float(sigmas * np.sqrt(2))


def choose_model(problem: Problem) -> Choice:
    """The simplest model that the observations support, by two-fold cross-validation over the elements."""
    if len(np.unique(problem.element)) < MIN_ELEMENTS:
        return Choice(LAMBERTIAN, None, note="Too few observations to look for a highlight.")
    metal = fit_lobe(problem, "frames", True)
    if float(metal.psi.mean()) > METAL_PSI and metal.phi <= METAL_PHI:
        gain, sigmas = _held_out(problem, True)
        if gain > MIN_GAIN and sigmas > MIN_SIGMAS:
            return Choice(METAL, metal, gain, sigmas)
    fit = fit_lobe(problem, "frames", False, LEAST_PSI)
    gain, sigmas = _held_out(problem, False)
    if gain > MIN_GAIN and sigmas > MIN_SIGMAS and fit.psi[0] <= METAL_PSI and fit.phi <= DIELECTRIC_PHI:
        return Choice(SPECULAR, fit, gain, sigmas)
    return Choice(LAMBERTIAN, fit, gain, sigmas, "Roughness and specular are not identifiable from these frames.")


def adopt_from_class(
    choices: dict[int, Choice], problems: dict[int, Problem], class_of: dict[int, str]
) -> dict[int, Choice]:
    """Let objects whose own frames decide nothing take over what others of their class were found to be.

    The class's lobe is the one of the member with the strongest evidence. It is refused where it raises the object's
    own cost by more than `EXCLUDED`: then the object is not like its class.
    """
    result = dict(choices)
    best: dict[str, int] = {}
    for object_id, choice in choices.items():
        name = class_of[object_id]
        if choice.model != LAMBERTIAN and (name not in best or choice.sigmas > choices[best[name]].sigmas):
            best[name] = object_id
    for object_id, choice in choices.items():
        source = best.get(class_of[object_id])
        if choice.model != LAMBERTIAN or source is None:
            continue
        model = choices[source]
        if object_id in problems and len(np.unique(problems[object_id].element)) >= MIN_ELEMENTS:
            own = model.fit if choice.fit is None else replace(model.fit, kappa_lambertian=choice.fit.kappa_lambertian)
            own = replace(own, residual=choice.fit.residual if choice.fit else own.residual)
            gain, _ = gain_of(own, problems[object_id])
            if gain < -EXCLUDED:
                continue
        note = f"Not identifiable by itself; takes over the lobe of object {source} of its class."
        result[object_id] = replace(model, gain=0.0, sigmas=0.0, note=note)
    return result


def metal_f0(problem: Problem, phi_index: int) -> np.ndarray:
    """F0 of a metal, (3,): all its light is the lobe's, so I = F0 A + B; the median ratio over the observations."""
    A = problem.light.A[:, phi_index].astype(np.float64)
    B = problem.light.B[:, phi_index].astype(np.float64)
    strong = A.mean(1) >= np.median(A.mean(1)) * 0.5
    ratio = (problem.radiance[strong] - B[strong]) / np.maximum(A[strong], 1e-9)
    return np.clip(np.median(ratio, 0), 0.02, 1.0)
