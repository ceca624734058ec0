"""Diffuse albedo alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compensation import ior_of, layer_reflectance
from .model import Brdf, Parameters, Principled


@dataclass(frozen=True, eq=False)
class Lambertian(Brdf):
    """Reflects the same to all sides; under an assumed coat (`Parameters.coat`) where too little was seen of it."""

    def base_color(self, albedo: np.ndarray, of: Parameters) -> np.ndarray:
        """The albedo; under a coat what that leaves of it."""
        if not of.coat:
            return albedo
        # The frames' albedo is all that it reflects, so what the coat does is no longer the diffuse part's.
        coat = float(layer_reflectance(of.coat["f0"], of.coat["roughness"] ** 2))
        return np.clip((albedo - coat) / (1 - coat), 0, 1)  # 1 itself would come out as 1 + 1e-7

    def principled(self, of: Parameters) -> Principled:
        """No lobe, but for a coat."""
        if not of.coat:
            return Principled()
        return Principled(roughness=of.coat["roughness"], ior=ior_of(of.coat["f0"]), specular_level=0.5)


LAMBERTIAN = Lambertian(
    name="lambertian",
    label="Diffuse",
    text="Reflects the same to all sides, as chalk and plain wall paint",
    colour=(150, 150, 150),
    icon="SHADING_SOLID",
    parameters=("base_color",),
)
