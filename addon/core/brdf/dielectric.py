"""A diffuse part under a dielectric's microfacet lobe: the paper's model (sec. 3.3)."""

from dataclasses import dataclass

import numpy as np

from .compensation import base_color, ior_of
from .ggx import GGX
from .model import F0, Brdf, Constraints, Microfacets, Parameters, Principled, Prior, roughness

MIN_F0 = 0.02
"""No solid dielectric reflects less at normal incidence (n = 1.33); a smaller fitted F0 is no lobe at all."""
TYPICAL_F0 = 0.04
"""What a dielectric of one colour reflects at normal incidence (n = 1.5)."""
MAX_F0 = 0.12
"""No common dielectric reflects more (n = 2.06); what does is a metal or a mirror."""
SATIN = 0.5
"""Roughness of what no frame shows well enough: most paints, woods and plastics lie around it."""
PRIOR = Prior(TYPICAL_F0, 0.01)
"""Plastics, lacquers, glass and woods have n = 1.4 to 1.6, F0 = 0.03 to 0.05. A broad lobe can be a little broader and
much stronger for nearly the same frames (living room's panels: alpha 0.39 with F0 0.05 or 0.45 with 0.1): there this
decides; where the frames show it, they outweigh it."""


@dataclass(frozen=True, eq=False)
class Dielectric(Brdf):
    """Albedo under a lobe without colour of its own."""

    icon: str = "SHADING_TEXTURE"
    microfacets: Microfacets | None = GGX
    parameters: tuple[str, ...] = ("roughness", "f0", "base_color")
    constraints: Constraints = Constraints(least_psi=MIN_F0, prior=PRIOR)

    def plausible_f0(self, base_color=None) -> F0:
        """Of an index of refraction of 1.5, whatever the colour."""
        return TYPICAL_F0

    def base_color(self, albedo: np.ndarray, of: Parameters) -> np.ndarray:
        """More than the albedo by what Principled's specular layer takes from its diffuse part."""
        # Above 1 the object would reflect more than all light, and a room of it would never grow dark.
        return np.minimum(base_color(albedo, float(np.mean(of.f0 or 0.0)), of.alpha or 0.0), 1)

    def principled(self, of: Parameters) -> Principled:
        """The lobe by its index of refraction."""
        return Principled(roughness=roughness(of), ior=ior_of(float(np.mean(of.f0 or 0.0))), specular_level=0.5)


DIELECTRIC = Dielectric(
    name="specular",
    label="Glossy",
    text="Colour under a clear highlight, as plastic, lacquer, varnished wood, tiles",
    colour=(60, 130, 220),
)
