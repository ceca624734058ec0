"""Materials as found against a capture's truth: roughness and model, object by object. Never read by the pipeline."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.brdf.material import ObjectMaterial
from ..core.kinds import Workload

LEAST_PIXELS: Workload[int] = 100
"""In the held-out views, that an object is judged by."""
UNTOLD: Workload[float] = 0.5
"""Blender's Roughness where the result says none."""


@dataclass(frozen=True)
class MaterialScores:
    """How right the materials are.

    Attributes
    ----------
    roughness_by_pixel, roughness_by_object : float
        Mean absolute error of sqrt(alpha); NaN where the truth has none.
    models : dict of str to int
        'true as found': how many objects.
    """

    roughness_by_pixel: float
    roughness_by_object: float
    models: dict[str, int]

    @property
    def objects(self) -> int:
        return sum(self.models.values())

    @property
    def right(self) -> int:
        return sum(n for name, n in self.models.items() if len(set(name.split(" as "))) == 1)


def found_kind(material: ObjectMaterial) -> str:
    """The model's name."""
    return material.model.name


def true_kind(known: Mapping[str, Any]) -> str:
    """The same of an object of truth/materials.json."""
    if known["emission"]:
        return "emitter"
    if known["metallic"]:
        return "metal"
    diffuse = known["alpha"] is None if "bsdf" not in known else known["bsdf"] == "diffuse"  # the demo has none
    return "lambertian" if diffuse else "specular"


def found_roughness(material: ObjectMaterial) -> float | None:
    """sqrt(alpha) as found."""
    return None if material.alpha is None else float(np.sqrt(material.alpha))


def true_roughness(known: Mapping[str, Any]) -> float | None:
    """sqrt(alpha) in truth."""
    return None if known["alpha"] is None or known["emission"] else float(np.sqrt(known["alpha"]))


def score_materials(
    materials: Iterable[ObjectMaterial], truth: Mapping[int, Mapping[str, Any]], pixels: Mapping[int, int]
) -> MaterialScores:
    """Compare what was found with truth/materials.json by object id, over what the held-out views show well enough.

    Parameters
    ----------
    pixels : mapping of int to int
        Of each object in the held-out views.
    """
    errors, weights, models = [], [], {}
    for material in materials:
        known = truth.get(material.object_id)
        seen = pixels.get(material.object_id, 0)
        if known is None or seen < LEAST_PIXELS or known["masked"] or known["bsdf"] == "dielectric":
            continue
        rough, true = found_roughness(material), true_roughness(known)
        if true is not None:
            errors.append(abs((UNTOLD if rough is None else rough) - true))
            weights.append(seen)
        name = f"{true_kind(known)} as {found_kind(material)}"
        models[name] = models.get(name, 0) + 1
    if not errors:
        return MaterialScores(float("nan"), float("nan"), models)
    return MaterialScores(float(np.average(errors, weights=weights)), float(np.mean(errors)), models)
