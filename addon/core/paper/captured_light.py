"""L(x, w), the light that arrives at x from w (Haefner et al. 2021, sec. 3.2): where the ray hits, it is L_d.

So no lamp need be known, and one ray stands for all bounces: what the frames saw of a surface holds them already.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Protocol

import numpy as np

from ..scene.atlas import Atlas
from ..scene.elements import ElementLookup
from ..scene.model import Mesh
from ..scene.rays import RayScene


class Light(Protocol):
    """What the paper's integrals need of a room."""

    scene: RayScene

    def along(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Radiance that comes back along rays ((n, 3) float32), how far they go, and the element hit, or -1."""


class CapturedLight:
    """The captured room as its own light.

    Parameters
    ----------
    lit_diffuse : (n, 3) float32
        L_d of each element; where no frame saw it, NaN: it counts as dark.
    outside : callable, optional
        Radiance from directions ((k, 3) float32) in which a ray leaves the mesh; dark where not given, as in the
        paper's closed rooms.
    """

    def __init__(
        self,
        mesh: Mesh,
        atlas: Atlas,
        scene: RayScene,
        lit_diffuse: np.ndarray,
        outside: Callable[[np.ndarray], np.ndarray] | None = None,
    ):
        self.mesh, self.atlas, self.scene, self.outside = mesh, atlas, scene, outside
        self.radiance = np.nan_to_num(np.asarray(lit_diffuse, np.float32))

    @cached_property
    def _element_at(self) -> ElementLookup:
        return ElementLookup(self.mesh, self.atlas)

    def along(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """L(x, w) along rays ((n, 3) float32 each), distances in metres, and elements; -1 where a ray leaves."""
        hits = self.scene.intersect(origins, directions)
        element = np.full(len(origins), -1, np.int32)
        hit = np.flatnonzero(hits.triangle >= 0)
        element[hit] = self._element_at(hits.triangle[hit], hits.u[hit], hits.v[hit])
        radiance = np.zeros((len(origins), 3), np.float32)
        radiance[hit] = self.radiance[element[hit]]
        escaped = np.flatnonzero(element < 0)
        if self.outside is not None and len(escaped):
            radiance[escaped] = self.outside(directions[escaped])
        return radiance, hits.distance, element
