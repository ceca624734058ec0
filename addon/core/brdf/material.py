"""What was recovered of each object: the description that stands between the core and Blender."""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from ..groups import by_number
from ..kinds import Unit
from ..naming import object_name
from .lambertian import LAMBERTIAN
from .model import F0, Brdf
from .registry import named

Z90: Unit[float] = 1.645
"""A 90 % interval is the value -+ this many standard errors."""


@dataclass(frozen=True)
class ObjectMaterial:
    """The material of one instance.

    Attributes
    ----------
    model : Brdf
        By its name in JSON.
    alpha : float or None
        GGX's alpha of the lobe, 0...1 (Blender's Roughness is its square root). None where there is no lobe.
    f0 : float, (3,) tuple of float or None
        The lobe's reflectance at normal incidence, 0...1; three numbers, linear Rec.709, of a metal.
    emission : (3,) tuple of float or None
        Emitter only: the radiance that it gives of itself, linear Rec.709; what it reflects comes on top.
    unlit : float or None
        Emitter only: its albedo, as it shows with its light off; a guess. None: unknown, so `LAMP_ALBEDO`.
    transmission : float or None
        Transparent only: share of a background's radiance that passes the object; of a cut-out, the share of holes.
    surfaces : float or None
        Glass only: how many of its surfaces a ray crosses; None of a cut-out.
    target_frame : str or None
        Name of the frame that showed the highlight best (assumptions A1, A2).
    residual : float or None
        Median size of the fit's residual, relative to the radiance of the element it is seen on.
    residual_lambertian : float or None
        The same with no lobe at all; what the lobe had to beat.
    observations : int
        Pixels that the fit used.
    roughness_low, roughness_high : float or None
        90 % interval of Blender's roughness, sqrt(alpha); 0 and 1 where it is not identifiable. None for emitters.
    f0_low, f0_high : float or None
        The same of F0, of a metal in the mean; all that a dielectric can have where it is not identifiable.
    scores : dict of str to float
        Cost on observations that the fit has not seen, relative to the Lambertian's, of each model that was tried:
        below 1 is better.
    note : str
        Why a richer model was not taken, or what is doubtful; '' if nothing is.
    given : dict
        What the artist gave of it, as `overrides.Given.as_dict` has it.
    """

    object_id: int
    class_name: str
    model: Brdf
    alpha: float | None = None
    f0: F0 | None = None
    emission: tuple[float, float, float] | None = None
    unlit: float | None = None
    transmission: float | None = None
    surfaces: float | None = None
    target_frame: str | None = None
    residual: float | None = None
    residual_lambertian: float | None = None
    observations: int = 0
    roughness_low: float | None = None
    roughness_high: float | None = None
    f0_low: float | None = None
    f0_high: float | None = None
    scores: dict[str, float] = field(default_factory=dict)
    note: str = ""
    given: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What the object is called everywhere."""
        return object_name(self.class_name, self.object_id)

    def as_dict(self) -> dict[str, Any]:
        """As materials.json and a stored stage have it."""
        return {field.name: getattr(self, field.name) for field in fields(self)} | {"model": self.model.name}


def with_metals(albedo: np.ndarray, object_id: np.ndarray, materials: Iterable[ObjectMaterial]) -> np.ndarray:
    """Albedo, and F0 of metals: Base Color that makes up for nothing. Parameters as of `base_colors`."""
    color = albedo.copy()
    groups = by_number(object_id)
    for m in materials:
        if m.model.lobe_alone and m.object_id in groups:
            color[groups[m.object_id]] = m.f0
    return color


def base_colors(albedo: np.ndarray, object_id: np.ndarray, materials: Iterable[ObjectMaterial]) -> np.ndarray:
    """Principled's Base Color of every element, (n, 3) float32, 0...1.

    Parameters
    ----------
    albedo : (n, 3) float32
        Diffuse albedo.
    object_id : (n,) int
    """
    color, elements = albedo.copy(), by_number(object_id)
    for m in materials:
        if (index := elements.get(m.object_id)) is not None:
            color[index] = m.model.base_color(color[index], m)
    return color


def undescribed(object_id: int, class_name: str) -> ObjectMaterial:
    """The description of an object of which nothing was recovered."""
    return ObjectMaterial(object_id, class_name, LAMBERTIAN, note="no description")


EARLIER = {"alpha": "phi", "f0": "psi", "f0_low": "specular_low", "f0_high": "specular_high"}
"""What results of version 0.1 call them."""


def renamed(entry: dict[str, Any]) -> dict[str, Any]:
    """An entry of materials.json with the current names."""
    current = {name: value for name, value in entry.items() if name not in EARLIER.values()}
    for name, earlier in EARLIER.items():
        if entry.get(earlier) is not None and current.get(name) is None:
            current[name] = entry[earlier]
    return current


def from_json(entry: dict[str, Any]) -> ObjectMaterial:
    """A description as materials.json or a stored stage has it; further keys are left out.

    Raises `BadInputError` where its model is of a package that is not there.
    """
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in renamed(entry).items()
        if name in ObjectMaterial.__dataclass_fields__
    }
    return ObjectMaterial(**values | {"model": named(values["model"])})
