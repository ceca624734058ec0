"""An object's description (`ObjectMaterial`), from its fit or from given values."""

from dataclasses import replace

import numpy as np

from ...brdf.emitter import EMITTER, LAMP_ALBEDO
from ...brdf.material import ObjectMaterial
from ...brdf.metal import METAL
from ...fit.problem import Problem
from ...light.mirrors import Mirror
from ...luminance import rgb
from ...results.overrides import Given
from ...scene.model import Instance
from .given import given_interval, given_note
from .intervals import GlossInterval
from .models import Choice, metal_f0
from .params import FIT


def lamp_material(
    instance: Instance, radiance: np.ndarray, irradiance: np.ndarray, note: str, unlit: float | None = None
) -> ObjectMaterial:
    """The description of a lamp that was seen with `radiance` ((3,)), under the E of its elements, (k, 3).

    `unlit` is its albedo with its light off; None where unknown.
    """
    median_irradiance = np.median(irradiance, 0) if len(irradiance) else np.zeros(3)
    emission = given_off(radiance, median_irradiance, LAMP_ALBEDO if unlit is None else unlit)
    return ObjectMaterial(instance.object_id, instance.class_name, EMITTER, emission=emission, unlit=unlit, note=note)


def given_off(radiance: np.ndarray, irradiance: np.ndarray, albedo: float) -> tuple[float, float, float]:
    """Emission of a lamp seen with `radiance` ((3,)) under E ((3,)): less its reflection, `albedo` of that at most."""
    reflected = np.minimum(albedo * irradiance / np.pi, albedo * radiance)
    return rgb(radiance - reflected)


def flat_mirror(instance: Instance, mirror: Mirror, observations: int) -> ObjectMaterial:
    """The description of a mirror that was found before the shading, or that the capture states."""
    note = "A flat mirror: the frames show the room in it." if observations else "A flat mirror, as the capture tells."
    return ObjectMaterial(
        instance.object_id, instance.class_name, METAL, alpha=0.0, f0=METAL.as_f0(mirror.f0),
        observations=observations, roughness_low=0.0, roughness_high=FIT.unresolved if observations else 0.0, note=note,
    )  # fmt: skip


def described(
    instance: Instance, choice: Choice, problem: Problem | None, target: str | None, interval: GlossInterval
) -> ObjectMaterial:
    """The description of an object with the model that was chosen for it."""
    fit = choice.fit
    common = ObjectMaterial(
        instance.object_id,
        instance.class_name,
        choice.model,
        target_frame=target,
        observations=0 if problem is None else len(problem.element),
        residual=None if fit is None else fit.residual,
        residual_lambertian=None if fit is None else fit.residual_lambertian,
        roughness_low=interval.roughness[0],
        roughness_high=interval.roughness[1],
        f0_low=interval.specular[0],
        f0_high=interval.specular[1],
        scores=choice.scores,
        note=choice.note,
    )
    if choice.see_through is not None:
        see_through = choice.see_through
        surfaces = None if see_through.cut_out else see_through.surfaces
        return replace(common, transmission=see_through.transmission, surfaces=surfaces)
    if not choice.model.has_lobe:
        return replace(common, residual=common.residual_lambertian)
    f0 = metal_f0(problem, choice.lobe.phi) if choice.model.lobe_alone and problem is not None else choice.lobe.psi
    return replace(common, alpha=choice.lobe.phi, f0=choice.model.as_f0(f0))


def as_given(material: ObjectMaterial, given: Given, choice: Choice, fitted_interval: GlossInterval) -> ObjectMaterial:
    """The description of an object with given values; `fitted_interval` is of the fitted ones."""
    note = given_note(given)
    if not choice.model.has_lobe:  # no lobe: F0 is known to be 0, a roughness does not apply
        return replace(material, roughness_low=None, roughness_high=None, f0_low=0.0, f0_high=0.0, note=note)
    interval = given_interval(given, choice, fitted_interval)
    f0 = choice.model.as_f0(choice.lobe.psi if given.f0 is None else given.f0)
    fitted = choice.lobe.residual > 0
    return replace(
        material, f0=f0, note=note, residual=material.residual if fitted else None,
        residual_lambertian=material.residual_lambertian if fitted else None,
        roughness_low=interval.roughness[0], roughness_high=interval.roughness[1],
        f0_low=interval.specular[0], f0_high=interval.specular[1],
    )  # fmt: skip
