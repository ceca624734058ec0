"""A lamp: gives light of itself; what it reflects is unknown."""

from dataclasses import dataclass

from .lambertian import TYPICAL_ALBEDO
from .model import Brdf, Parameters, Principled

LAMP_ALBEDO = TYPICAL_ALBEDO
"""What a lamp reflects can't be measured under its own light. Shades and diffusers are white to grey: switched off,
a lamp of which nothing else is known (`passes.unlit_lamps`) shows this grey. Black, it is a hole in the room (living
room, lamps off: 1 % of the pixels, half of the error)."""


@dataclass(frozen=True, eq=False)
class Emitter(Brdf):
    """Emits its radiance to all sides, over what it reflects, a guess."""

    def principled(self, of: Parameters) -> Principled:
        """Of a description's radiance what the lamp reflects has been taken off."""
        albedo = LAMP_ALBEDO if of.unlit is None else of.unlit
        return Principled(base_color=(albedo,) * 3, emission=of.emission or (0.0, 0.0, 0.0))


EMITTER = Emitter(
    name="emitter",
    label="Lamp",
    text="Gives light of itself",
    colour=(255, 240, 150),
    icon="LIGHT_AREA",
    has_diffuse=False,
    gives_light=True,
)
