"""Materials as found against a capture's truth: roughness and model, object by object. Never read by the pipeline."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.brdf.material import ObjectMaterial
from ..core.kinds import Workload

MIN_PIXELS: Workload[int] = 100
"""In the held-out views, that an object is judged by."""
DEFAULT_ROUGHNESS: Workload[float] = 0.5
"""Blender's Roughness where the result says none."""


@dataclass(frozen=True)
class MaterialScores:
    """How well the materials match the truth.

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


def true_kind(entry: Mapping[str, Any]) -> str:
    """The name of the model of an object of truth/materials.json."""
    if entry["emission"]:
        return "emitter"
    if entry["metallic"]:
        return "metal"
    diffuse = entry["alpha"] is None if "bsdf" not in entry else entry["bsdf"] == "diffuse"  # the demo has none
    return "lambertian" if diffuse else "specular"


def found_roughness(material: ObjectMaterial) -> float | None:
    """sqrt(alpha) as found."""
    return None if material.alpha is None else float(np.sqrt(material.alpha))


def written_roughness(material: ObjectMaterial) -> float:
    """sqrt(alpha), Blender's own where none was found."""
    roughness = found_roughness(material)
    return DEFAULT_ROUGHNESS if roughness is None else roughness


def true_roughness(entry: Mapping[str, Any]) -> float | None:
    """sqrt(alpha) in truth."""
    return None if entry["alpha"] is None or entry["emission"] else float(np.sqrt(entry["alpha"]))


def score_materials(
    materials: Iterable[ObjectMaterial], truth: Mapping[int, Mapping[str, Any]], pixels: Mapping[tuple[int, int], int]
) -> MaterialScores:
    """Compare what was found with truth/materials.json, object by object, over what held-out views show well enough.

    Where a capture has no objects, an object of the truth has the model that most of its pixels show.

    Parameters
    ----------
    pixels : mapping of (int, int) to int
        Of each object of the truth, by the object found there: `truth_views.pairs`.
    """
    by_id = {material.object_id: material for material in materials}
    pixels_of: dict[int, dict[int, int]] = {}
    for (true_id, found_id), count in pixels.items():
        if true_id in truth and found_id in by_id:
            pixels_of.setdefault(true_id, {})[found_id] = count
    errors, weights, models = [], [], Counter[str]()
    for true_id, by_part in sorted(pixels_of.items()):
        entry, seen = truth[true_id], sum(by_part.values())
        if seen < MIN_PIXELS or entry["masked"] or entry["bsdf"] == "dielectric":
            continue
        true = true_roughness(entry)
        if true is not None:
            error = {i: abs(written_roughness(by_id[i]) - true) for i in by_part}
            errors.append(sum(error[i] * n for i, n in by_part.items()) / seen)
            weights.append(seen)
        by_kind: Counter[str] = Counter()
        for i, n in by_part.items():
            by_kind[by_id[i].model.name] += n
        models[f"{true_kind(entry)} as {by_kind.most_common(1)[0][0]}"] += 1
    if not errors:
        return MaterialScores(float("nan"), float("nan"), models)
    return MaterialScores(float(np.average(errors, weights=weights)), float(np.mean(errors)), models)
