"""Diffuse albedo alone."""

from dataclasses import dataclass

from ..kinds import Unit
from .model import Brdf

WHITE_PAINT: Unit[float] = 0.8
"""Albedo of white wall paint, as the panel has it."""
TYPICAL_ALBEDO = 0.5
"""Of a room's surfaces, on average: what is taken where nothing is known."""


@dataclass(frozen=True, eq=False)
class Lambertian(Brdf):
    """Reflects the same to all sides."""


LAMBERTIAN = Lambertian(
    name="lambertian",
    label="Diffuse",
    text="Reflects the same to all sides, as chalk and plain wall paint",
    colour=(150, 150, 150),
    icon="SHADING_SOLID",
    parameters=("base_color",),
)
