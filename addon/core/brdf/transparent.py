"""What shows what lies behind it: glass, or cut out by a mask that the mesh does not have. Set apart, not modelled."""

from dataclasses import dataclass

import numpy as np

from .model import Brdf, Parameters, Principled


def opacity(of: Parameters) -> float:
    """Blender's Alpha: share of the light that each surface of the object stops; 1 but for glass."""
    if of.transmission is None or of.surfaces is None:
        return 1.0
    return 1 - min(max(of.transmission, 0.0), 1.0) ** (1 / max(of.surfaces, 1.0))


@dataclass(frozen=True, eq=False)
class Transparent(Brdf):
    """An albedo, and a share of the light that passes."""

    def base_color(self, albedo: np.ndarray, of: Parameters) -> np.ndarray:
        """Each surface reflects as much less as it lets pass."""
        if of.transmission is None or opacity(of) == 1:
            return albedo
        return np.minimum(albedo / max(1 - of.transmission, 0.01), 1)

    def principled(self, of: Parameters) -> Principled:
        """Glass lets a share of the light through straight on: no bending, as frames say nothing of it."""
        return Principled(alpha=opacity(of))


TRANSPARENT = Transparent(
    name="transparent",
    label="Glass",
    text="Shows what is behind it; found by a run, it can't be given",
    colour=(120, 200, 190),
    icon="MOD_OPACITY",
    see_through=True,
    parameters=("base_color",),
    can_be_given=False,
)
