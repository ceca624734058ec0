"""A metal: the lobe alone, coloured."""

from dataclasses import dataclass

import numpy as np

from ..luminance import rgb
from .ggx import GGX
from .model import F0, Brdf, Constraints, Microfacets, Parameters, Principled, roughness

TYPICAL_F0 = 0.6
"""What common metals reflect at normal incidence."""


@dataclass(frozen=True, eq=False)
class Metal(Brdf):
    """No diffuse part; F0 is its colour."""

    icon: str = "SHADING_RENDERED"
    has_diffuse: bool = False
    microfacets: Microfacets | None = GGX
    parameters: tuple[str, ...] = ("roughness", "f0", "base_color")
    constraints: Constraints = Constraints(coloured=True)

    def as_f0(self, value) -> F0 | None:
        """Three numbers."""
        return None if value is None else rgb(np.broadcast_to(np.asarray(value, float), 3))

    def plausible_f0(self, base_color=None) -> F0:
        """The colour it is known by."""
        return tuple(base_color) if base_color else (TYPICAL_F0,) * 3

    def base_color(self, albedo: np.ndarray, of: Parameters) -> np.ndarray:
        """F0."""
        return np.broadcast_to(np.asarray(of.f0, albedo.dtype), albedo.shape)

    def principled(self, of: Parameters) -> Principled:
        """Metallic, in the colour of its F0."""
        colour = (0.5, 0.5, 0.5) if of.f0 is None else rgb(np.clip(np.broadcast_to(of.f0, 3), 0, 1))
        return Principled(base_color=colour, roughness=roughness(of), metallic=1.0, specular_level=0.5)


METAL = Metal(
    name="metal",
    label="Metal",
    text="Bare metal: all that it reflects is its highlight, in the metal's colour",
    colour=(225, 150, 40),
)
