"""Objects with values given by the artist: those are kept, and the others are fitted with them fixed.

Given values decide the model, too, unless that is given itself: a roughness or F0 makes an object glossy, an F0 that no
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
from .params import CHOICE, FIT
from .problems import Problems


def fit_given(
    given: Given, problems: Problems, object_id: int, irradiance: np.ndarray, rays: int
) -> tuple[Choice, Problem | None]:
    """Model and lobe of an object with given values, and the observations that the others were fitted to.

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
        return Choice(given.brdf, None, sigmas=CHOICE.sure), None
    phi = None if given.roughness is None else given.roughness**2
    problem, enough = _problem(problems, object_id, rays, phi, (given.brdf or DIELECTRIC).microfacets or GGX)
    model = given.brdf or _model(given, problem, enough)
    f0 = None if given.f0 is None else np.broadcast_to(np.asarray(model.as_f0(given.f0), float), 3)
    fit = _fit(model, phi, f0, problem, enough, irradiance)
    if phi is not None:
        fit = replace(fit, phi=phi)  # not the nearest that the grid has
    return Choice(model, replace(fit, psi=fit.psi if f0 is None else f0), gain=0.0, sigmas=CHOICE.sure), problem


def _problem(
    problems: Problems, object_id: int, rays: int, phi: float | None, microfacets: Microfacets
) -> tuple[Problem | None, bool]:
    """The object's observations, and whether they suffice to see what changes with the view."""
    index, enough = problems.pick(object_id, LEVELS.of_object, FIT.views, seed=1, smooth=True), True
    if len(np.unique(problems.element(index))) < LEVELS.few:
        index, enough = problems.pick(object_id, LEVELS.of_object, LEVELS.views, min_views=1, seed=1), False
    if not len(index):
        return None, False
    width = None if phi is None else max(phi, float(GRID[0]))
    return problems.problem(index, rays, phi=width, microfacets=microfacets), enough


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
    """The intervals of given values, without width, and of the others as fitted."""
    if not choice.model.has_lobe:
        return UNKNOWN
    rough = (given.roughness,) * 2 if given.roughness is not None else fitted.roughness
    mean = None if given.f0 is None else float(np.mean(given.f0))
    return GlossInterval(rough, (mean,) * 2 if mean is not None else fitted.specular)


def given_note(given: Given) -> str:
    """One sentence that names the given values."""
    values = given.as_dict()
    parts = [
        f"{name} {_formatted(values[name])}" for name in ("model", "roughness", "f0", "base_color") if name in values
    ]
    fitted_names = (
        []
        if given.brdf is not None and not given.brdf.has_lobe
        else [name for name, value in (("roughness", given.roughness), ("f0", given.f0)) if value is None]
    )
    fitted = f"; {' and '.join(fitted_names)} fitted under it" if fitted_names and len(values) else ""
    lamp = " The light on the room was not found anew." if given.brdf is not None and given.brdf.gives_light else ""
    return f"Given by the user: {', '.join(parts)}{fitted}.{lamp}"


def same_material(source: ObjectMaterial, material: ObjectMaterial) -> ObjectMaterial:
    """An object's description with the model and lobe of another one, `source`."""
    copied = ("model", "alpha", "f0", "emission", "transmission", "surfaces", "roughness_low", "roughness_high",
             "f0_low", "f0_high")  # fmt: skip
    note = f"Given by the user: the same as object {source.object_id}."
    return replace(material, **{name: getattr(source, name) for name in copied}, note=note)


def _formatted(value: object) -> str:
    if isinstance(value, list):
        return f"({', '.join(f'{item:.3g}' for item in value)})"
    return value if isinstance(value, str) else f"{value:.3g}"
