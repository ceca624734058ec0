"""The light field of the captured room: radiance along any ray is L_d where it hits, the environment where it leaves."""

from __future__ import annotations

import numpy as np

from ..capture.model import Mesh
from ..surface.atlas import Atlas
from ..surface.elements import element_of_triangle, lookup
from ..surface.rays import Hits, RayScene
from .environment import Environment


class LightField:
    """L(x, w) (Haefner et al. 2021, sec. 3.2: "radiance at a hit is L_d there").

    Parameters
    ----------
    radiance : (n, 3) float32
        L_d of each element, no NaN.
    """

    def __init__(self, mesh: Mesh, atlas: Atlas, scene: RayScene, radiance: np.ndarray, environment: Environment):
        self.mesh, self.atlas, self.scene, self.environment = mesh, atlas, scene, environment
        self.radiance = np.ascontiguousarray(radiance, np.float32)
        self._fallback = element_of_triangle(mesh, atlas)

    def with_light(self, radiance: np.ndarray, environment: Environment | None = None) -> LightField:
        """The same room with another L_d and, if given, another environment."""
        other = object.__new__(LightField)
        other.__dict__.update(self.__dict__)
        other.radiance = np.ascontiguousarray(radiance, np.float32)
        other.environment = environment or self.environment
        return other

    def elements(self, hits: Hits) -> np.ndarray:
        """The element at each hit, (n,) int32; -1 where the ray escaped."""
        element = np.full(len(hits.triangle), -1, np.int32)
        hit = hits.triangle >= 0
        element[hit] = self.lookup(hits.triangle[hit], hits.u[hit], hits.v[hit])
        return element

    def lookup(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The element at points given by triangle (all >= 0) and barycentric coordinates, (n,) int32."""
        return lookup(self.atlas, self._fallback, self.mesh.object_id, triangle, u, v)

    def along(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Follow rays.

        Parameters
        ----------
        origins, directions : (n, 3) float32

        Returns
        -------
        radiance : (n, 3) float32
            Coming back along each ray.
        distance : (n,) float32
            inf where it escapes.
        element : (n,) int32
            -1 where it escapes.
        """
        hits = self.scene.intersect(origins, directions)
        element = self.elements(hits)
        radiance = self.radiance[element]
        escaped = element < 0
        if escaped.any():
            radiance[escaped] = self.environment(directions[escaped])
        return radiance, hits.distance, element
