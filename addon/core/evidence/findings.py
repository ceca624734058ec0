"""What a recovery found: all that evidence and page are made of."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..brdf.material import ObjectMaterial
from ..light.field import LightField
from ..light.shading import Shading
from ..passes.albedo.albedo import Albedo
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Frame, Instance
from ..scene.samples import Samples
from ..scene.surface import Surface


@dataclass(frozen=True)
class Findings:
    """What a recovery of n elements found.

    Attributes
    ----------
    name : str
        The capture's.
    frames : tuple of Frame
        In the coordinates of `surface`.
    field : LightField
        The room as E was gathered in it.
    specular : (n, 3) float32
        Part of each element's L_d that is specular.
    irradiance : (n, 3) float32
        The final E.
    coloured : frozenset of int
        Objects whose base colour the artist gave.
    threads, seed : int
        As of `Settings`.
    """

    name: str
    instances: tuple[Instance, ...]
    frames: tuple[Frame, ...]
    surface: Surface
    lit_diffuse: LitDiffuse
    samples: Samples
    shading: Shading
    field: LightField
    specular: np.ndarray
    irradiance: np.ndarray
    albedo: Albedo
    materials: list[ObjectMaterial]
    coloured: frozenset[int]
    threads: int
    seed: int

    @cached_property
    def emitters(self) -> set[int]:
        """Objects that have no albedo, as they are lamps."""
        return {m.object_id for m in self.materials if m.model.gives_light}
