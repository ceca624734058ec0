"""Objects of which the artist gives something: that is held, and what is left is fitted under it.

What is given decides the model, too, where that itself is not: a roughness or F0 makes an object glossy, an F0 that no
dielectric has makes it a metal. Nothing is chosen, nothing is taken over from the class.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...fit.layout import Layout, Problem
from ...fit.lobe_fit import LobeFit, fit_lobe
from ...light.lobes import GRID
from ...material import EMITTER, LAMBERTIAN, METAL, SPECULAR, ObjectMaterial
from ...overrides import Given
from .intervals import UNKNOWN, GlossInterval
from .models import HOW, METAL_PSI, MIN_ELEMENTS, Choice, choose_model, metal_f0, metal_fit
from .one_colour import DIELECTRIC_PSI, compare, compare_coat
from .problems import Problems

SURE = 1000.0
"""Standard errors that a given model or lobe counts for when others of its class take over what is sure."""
PLAUSIBLE_PHI, PLAUSIBLE_F0 = 0.25, 0.6
"""Of an object that no frame shows well enough: satin; and what common metals reflect."""
ELEMENTS, VIEWS, FEW_VIEWS = 350, 12, 4
"""Elements and views that the fit looks at; views where an element may have a single one."""


def fit_given(
    given: Given, maker: Problems, object_id: int, irradiance: np.ndarray, rays: int
) -> tuple[Choice, Problem | None]:
    """Model and lobe of an object under what is given of it, and the observations that the rest was fitted to.

    Parameters
    ----------
    given : Given
        Without `same_as`.
    irradiance : (n, 3) float32
        E of each element.
    rays : int
        Of each observation.
    """
    if given.model in (LAMBERTIAN, EMITTER):
        return Choice(given.model, None, sigmas=SURE), None
    phi = None if given.roughness is None else given.roughness**2
    problem, enough = _problem(maker, object_id, rays, phi)
    model = given.model or _model(given, problem, enough)
    f0 = None if given.f0 is None else np.broadcast_to(np.asarray(given.f0, float), 3)
    if f0 is not None and model == SPECULAR:
        f0 = np.full(3, f0.mean())
    fit = _fit(model, phi, f0, problem, enough, irradiance)
    if phi is not None:
        fit = replace(fit, phi=phi)  # not the nearest that the grid has
    return Choice(model, replace(fit, psi=fit.psi if f0 is None else f0), gain=0.0, sigmas=SURE), problem


def _problem(maker: Problems, object_id: int, rays: int, phi: float | None) -> tuple[Problem | None, bool]:
    """The object's observations, and whether they can tell what changes with the view."""
    index, enough = maker.pick(object_id, ELEMENTS, VIEWS, seed=1), True
    if len(np.unique(maker.element(index))) < MIN_ELEMENTS:
        index, enough = maker.pick(object_id, ELEMENTS, FEW_VIEWS, least=1, seed=1), False
    if not len(index):
        return None, False
    return maker.problem(index, rays, phi=None if phi is None else max(phi, float(GRID[0]))), enough


def _model(given: Given, problem: Problem | None, enough: bool) -> str:
    """The model of an object whose roughness or F0 is given."""
    if given.f0 is not None:
        return METAL if np.mean(given.f0) > METAL_PSI else SPECULAR
    return METAL if enough and choose_model(problem).model == METAL else SPECULAR


def _fit(
    model: str, phi: float | None, f0: np.ndarray | None, problem: Problem | None, enough: bool, irradiance: np.ndarray
) -> LobeFit:
    """The lobe; where `phi` is given, `problem` has no other."""
    if enough:
        layout = Layout(problem)
        how = {**HOW[model], **({} if f0 is None else {"psi": f0, "prior": None, "least_psi": 0.0})}
        if model == SPECULAR or f0 is not None:
            fit = fit_lobe(layout, **how)
            return replace(fit, psi=np.minimum(fit.psi, METAL_PSI)) if f0 is None else fit
        fit = metal_fit(problem, layout)
        return replace(fit, psi=metal_f0(problem, fit.phi))
    looks = None
    if problem is not None and phi is None:
        looks = (compare if model == METAL else compare_coat)(problem, irradiance)
    phi = phi if phi is not None else looks.phi if looks is not None else PLAUSIBLE_PHI
    psi = np.full(3, DIELECTRIC_PSI)
    if model == METAL:
        psi = metal_f0(problem, phi) if problem is not None else np.full(3, PLAUSIBLE_F0)
    return LobeFit(phi, psi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def given_interval(given: Given, choice: Choice, fitted: GlossInterval) -> GlossInterval:
    """The intervals of what was given, without width, and of the rest as fitted."""
    if choice.model not in (METAL, SPECULAR):
        return UNKNOWN
    rough = (given.roughness,) * 2 if given.roughness is not None else fitted.roughness
    mean = None if given.f0 is None else float(np.mean(given.f0))
    return GlossInterval(rough, (mean,) * 2 if mean is not None else fitted.specular)


def given_note(given: Given) -> str:
    """One sentence on what was given."""
    told = given.as_dict()
    said = [f"{name} {_said(told[name])}" for name in ("model", "roughness", "f0", "base_color") if name in told]
    rest = (
        []
        if given.model in (LAMBERTIAN, EMITTER)
        else [name for name, found in (("roughness", given.roughness), ("f0", given.f0)) if found is None]
    )
    fitted = f"; {' and '.join(rest)} fitted under it" if rest and len(told) else ""
    lamp = " The light on the room was not found anew." if given.model == EMITTER else ""
    return f"Given by the user: {', '.join(said)}{fitted}.{lamp}"


def same_material(other: ObjectMaterial, own: ObjectMaterial) -> ObjectMaterial:
    """An object's description with model and highlight of another one."""
    taken = ("model", "phi", "psi", "f0", "emission", "transmission", "surfaces", "roughness_low", "roughness_high",
             "specular_low", "specular_high")  # fmt: skip
    note = f"Given by the user: the same as object {other.object_id}."
    return replace(own, **{name: getattr(other, name) for name in taken}, note=note)


def _said(value: object) -> str:
    if isinstance(value, list):
        return f"({', '.join(f'{one:.3g}' for one in value)})"
    return value if isinstance(value, str) else f"{value:.3g}"
