"""What is found of a room's light: lamps, sky, sun, mirrors, and the irradiance E of every element."""

from dataclasses import dataclass, field

import numpy as np

from ..scene.patches import Patches
from .environment import Environment
from .lamps import Lamp
from .mirrors import Mirror
from .openings import Openings
from .sun import Sun


@dataclass(frozen=True)
class Shading:
    """What the shading stage finds, for n elements.

    Attributes
    ----------
    irradiance : (n, 3) float32
        E, radiance * steradian.
    escaped : (n,) float32
        Share of the hemisphere's rays that left the mesh.
    relative_error : (n,) float32
        Relative error of `irradiance` by interpolation and by the mesh's noise.
    radiance : (n, 3) float32
        L_d with everything filled in: what the light field shows at each element. Lamps have their own radiance.
    environment : Environment
        With the unseen sky solved for where it could be, without the sun.
    notes : tuple of str
        What was solved for, one sentence each.
    mirrors : tuple of Mirror
        Flat mirrors that light was followed over.
    points : int
        Places at which the hemisphere was gathered.
    sun : Sun or None
        Its part is in `irradiance`.
    openings : Openings or None
        What comes in by the mesh's openings, where that was solved for; else the environment does.
    patches : Patches
        Parts of the mesh that were found to be lamps by themselves.
    """

    irradiance: np.ndarray
    escaped: np.ndarray
    relative_error: np.ndarray
    radiance: np.ndarray
    lamps: tuple[Lamp, ...]
    environment: Environment
    notes: tuple[str, ...]
    mirrors: tuple[Mirror, ...]
    points: int
    sun: Sun | None = None
    openings: Openings | None = None
    patches: Patches = field(default_factory=Patches)

    @property
    def emitters(self) -> set[int]:
        """The lamps' objects."""
        return {lamp.object_id for lamp in self.lamps}
