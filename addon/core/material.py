"""What was recovered of each object: the description that stands between the core and Blender."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .naming import object_name

LAMBERTIAN = "lambertian"
SPECULAR = "specular"
METAL = "metal"
EMITTER = "emitter"
TRANSPARENT = "transparent"
MODELS = (LAMBERTIAN, SPECULAR, METAL, EMITTER, TRANSPARENT)
LAMP_ALBEDO = 0.5
"""What a lamp reflects can't be told under its own light. Shades and diffusers are white to grey: with its light off a
lamp shows this grey. Black, it is a hole in the room (living room, lamps off: 1 % of the pixels, half of the error)."""
Z90 = 1.645
"""A 90 % interval is the value -+ this many standard errors."""


@dataclass(frozen=True)
class ObjectMaterial:
    """The material of one instance.

    Attributes
    ----------
    object_id : int
    class_name : str
    model : str
        One of `MODELS`. 'lambertian': diffuse albedo alone. 'specular': diffuse albedo under the seed's microfacet
        lobe. 'metal': the lobe alone, coloured. 'emitter': gives light; its albedo is unknown. 'transparent': shows
        what lies behind it, as glass, or is cut out by a mask that the mesh does not have; set apart, not modelled.
    phi : float or None
        GGX alpha of the lobe, 0...1 (Blender's Roughness is its square root). None where there is no lobe.
    psi : float or None
        Specular: reflectance at normal incidence (F0), 0...1.
    f0 : (3,) tuple of float or None
        Metal only: coloured F0, linear Rec.709.
    emission : (3,) tuple of float or None
        Emitter only: the radiance that it gives of itself, linear Rec.709; what it reflects, as a grey of
        `LAMP_ALBEDO`, comes on top.
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
        90 % interval of Blender's roughness, sqrt(phi); 0 and 1 where it is not identifiable. None for emitters.
    specular_low, specular_high : float or None
        The same of psi, or of a metal's mean F0; all that a dielectric can have where it is not identifiable.
    scores : dict of str to float
        Cost on observations that the fit has not seen, relative to the Lambertian's, of each model that was tried:
        below 1 is better.
    note : str
        Why a richer model was not taken, or what is doubtful; '' if nothing is.
    given : dict
        What the artist gave of it, as `overrides.Given.as_dict` has it.
    coat : dict of str to float
        Lambertian only, for lack of evidence: `f0` and `roughness` (Blender's) of a dielectric's coat that is assumed.
    """

    object_id: int
    class_name: str
    model: str
    phi: float | None = None
    psi: float | None = None
    f0: tuple[float, float, float] | None = None
    emission: tuple[float, float, float] | None = None
    transmission: float | None = None
    surfaces: float | None = None
    target_frame: str | None = None
    residual: float | None = None
    residual_lambertian: float | None = None
    observations: int = 0
    roughness_low: float | None = None
    roughness_high: float | None = None
    specular_low: float | None = None
    specular_high: float | None = None
    scores: dict[str, float] = field(default_factory=dict)
    note: str = ""
    given: dict[str, Any] = field(default_factory=dict)
    coat: dict[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What the object is called everywhere."""
        return object_name(self.class_name, self.object_id)

    @property
    def opacity(self) -> float:
        """Blender's Alpha: share of the light that each surface of the object stops; 1 but for glass."""
        if self.transmission is None or self.surfaces is None:
            return 1.0
        return 1 - min(max(self.transmission, 0.0), 1.0) ** (1 / max(self.surfaces, 1.0))


def undescribed(object_id: int, class_name: str) -> ObjectMaterial:
    """What an object is taken for of which nothing was recovered."""
    return ObjectMaterial(object_id, class_name, LAMBERTIAN, note="no description")


def from_json(told: dict[str, Any]) -> ObjectMaterial:
    """A description as materials.json or a stored stage has it; further keys are left out."""
    known: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in told.items()
        if name in ObjectMaterial.__dataclass_fields__
    }
    return ObjectMaterial(**known)
