"""Objects of which the artist gives something: that is held, and what is left is fitted under it.

What is given decides the model, too, where that itself is not: a roughness or F0 makes an object glossy, an F0 that no
dielectric has makes it a metal. Nothing is chosen, nothing is taken over from the class.
"""

from dataclasses import replace

import numpy as np

from ...brdf.dielectric import DIELECTRIC, MAX_F0, SATIN
from ...brdf.ggx import GGX
from ...brdf.material import ObjectMaterial
from ...brdf.metal import METAL
from ...brdf.model import Brdf, Microfacets
from ...fit.lobe_fit import LobeFit, fit_lobe
from ...fit.problem import DenseProblem, Problem
from ...light.lobes import GRID
from ...results.overrides import Given
from ...significance import LEVELS
from .intervals import UNKNOWN, GlossInterval
from .models import Choice, choose_model, metal_f0, metal_fit
from .one_colour import compare, compare_coat
from .params import FIT, GIVEN
from .problems import Problems


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
    if given.brdf is not None and not given.brdf.has_lobe:
        return Choice(given.brdf, None, sigmas=GIVEN.sure), None
    phi = None if given.roughness is None else given.roughness**2
    problem, enough = _problem(maker, object_id, rays, phi, (given.brdf or DIELECTRIC).microfacets or GGX)
    model = given.brdf or _model(given, problem, enough)
    f0 = None if given.f0 is None else np.broadcast_to(np.asarray(model.as_f0(given.f0), float), 3)
    fit = _fit(model, phi, f0, problem, enough, irradiance)
    if phi is not None:
        fit = replace(fit, phi=phi)  # not the nearest that the grid has
    return Choice(model, replace(fit, psi=fit.psi if f0 is None else f0), gain=0.0, sigmas=GIVEN.sure), problem


def _problem(
    maker: Problems, object_id: int, rays: int, phi: float | None, microfacets: Microfacets
) -> tuple[Problem | None, bool]:
    """The object's observations, and whether they can tell what changes with the view."""
    index, enough = maker.pick(object_id, LEVELS.of_object, FIT.views, seed=1, smooth=True), True
    if len(np.unique(maker.element(index))) < LEVELS.few:
        index, enough = maker.pick(object_id, LEVELS.of_object, LEVELS.views, least=1, seed=1), False
    if not len(index):
        return None, False
    width = None if phi is None else max(phi, float(GRID[0]))
    return maker.problem(index, rays, phi=width, microfacets=microfacets), enough


def _model(given: Given, problem: Problem | None, enough: bool) -> Brdf:
    """The model of an object whose roughness or F0 is given."""
    if given.f0 is not None:
        return METAL if np.mean(given.f0) > MAX_F0 else DIELECTRIC
    chosen = choose_model(problem).model if enough and problem is not None else DIELECTRIC
    return chosen if chosen.has_lobe else DIELECTRIC


def _fit(
    model: Brdf, phi: float | None, f0: np.ndarray | None, problem: Problem | None, enough: bool, irradiance: np.ndarray
) -> LobeFit:
    """The lobe; where `phi` is given, `problem` has no other."""
    if enough and problem is not None:
        dense = DenseProblem(problem)
        if f0 is not None:
            return fit_lobe(dense, constraints=replace(model.constraints, least_psi=0.0, prior=None), psi=f0)
        if model.has_diffuse:
            fit = fit_lobe(dense, constraints=model.constraints)
            return replace(fit, psi=np.minimum(fit.psi, MAX_F0))
        fit = metal_fit(problem, dense)
        return replace(fit, psi=metal_f0(problem, fit.phi))
    looks = None
    if problem is not None and phi is None:
        looks = (compare_coat if model.has_diffuse else compare)(problem, irradiance)
    phi = phi if phi is not None else looks.phi if looks is not None else SATIN**2
    psi = np.broadcast_to(np.asarray(model.plausible_f0(), float), 3)
    if not model.has_diffuse and problem is not None:
        psi = metal_f0(problem, phi)
    return LobeFit(phi, psi, 0.0, 0.0, 0.0, 0.0)


def given_interval(given: Given, choice: Choice, fitted: GlossInterval) -> GlossInterval:
    """The intervals of what was given, without width, and of the rest as fitted."""
    if not choice.model.has_lobe:
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
        if given.brdf is not None and not given.brdf.has_lobe
        else [name for name, found in (("roughness", given.roughness), ("f0", given.f0)) if found is None]
    )
    fitted = f"; {' and '.join(rest)} fitted under it" if rest and len(told) else ""
    lamp = " The light on the room was not found anew." if given.brdf is not None and given.brdf.gives_light else ""
    return f"Given by the user: {', '.join(said)}{fitted}.{lamp}"


def same_material(other: ObjectMaterial, own: ObjectMaterial) -> ObjectMaterial:
    """An object's description with model and highlight of another one."""
    taken = ("model", "alpha", "f0", "emission", "transmission", "surfaces", "roughness_low", "roughness_high",
             "f0_low", "f0_high")  # fmt: skip
    note = f"Given by the user: the same as object {other.object_id}."
    return replace(own, **{name: getattr(other, name) for name in taken}, note=note)


def _said(value: object) -> str:
    if isinstance(value, list):
        return f"({', '.join(f'{one:.3g}' for one in value)})"
    return value if isinstance(value, str) else f"{value:.3g}"
