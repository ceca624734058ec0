"""What frames saw of a mirror, against the room as a mirror that faces a tried way would show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinds import Unit
from ...light.field import LightField
from ...scene.samples import Samples
from ...significance import LEVELS
from .params import MIRRORS

DARK: Unit[float] = 1e-5
"""What nobody saw is dark in the field so far: 0, but for rounding."""


@dataclass(frozen=True)
class Views:
    """m observations of a mirror's elements.

    Attributes
    ----------
    field : LightField
        The room; this mirror not yet one of its.
    element : (m,) int32
    origin, direction : (m, 3) float32
        Just off the surface, and towards the camera.
    radiance : (m, 3) float32
    """

    field: LightField
    element: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    radiance: np.ndarray

    @staticmethod
    def of(field: LightField, samples: Samples, index: np.ndarray) -> Views:
        """Those of `samples` ((m,) int indices)."""
        element = samples.element[index]
        origin = field.scene.off_surface(field.atlas.position[element], field.atlas.normal[element])
        return Views(field, element, origin, samples.direction[index], samples.radiance[index])

    def __len__(self) -> int:
        return len(self.element)

    def part(self, index: np.ndarray) -> Views:
        """Some of them."""
        return Views(self.field, *(getattr(self, k)[index] for k in ("element", "origin", "direction", "radiance")))

    def known(self, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
        """Which observations ((k,) int) a mirror that faces `normals` shows something known in, what ((k, 3)), and the
        logarithm of what was seen and of what it shows, (k,) each."""
        along = 2 * np.einsum("ij,ij->i", self.direction, np.broadcast_to(normals, self.direction.shape))[:, None]
        shown = self.field.along(self.origin, (along * normals - self.direction).astype(np.float32))[0]
        known = np.flatnonzero(shown.mean(1) > DARK)
        if len(known) < LEVELS.many:
            return None
        seen, shown = self.radiance[known], shown[known]
        return known, shown, *(np.log(np.maximum(x.mean(1), DARK)) for x in (seen, shown))

    def off(self, normal: np.ndarray) -> float:
        """Mean absolute deviation of log radiance from a mirror that faces one way ((3,)); inf where too little is
        known.
        """
        found = self.known(normal)
        if found is None:
            return np.inf
        ratio = found[2] - found[3]
        # Beside an edge a ray of a slightly other way meets something else altogether.
        return float(np.minimum(np.abs(ratio - np.median(ratio)), MIRRORS.stray).mean())

    def compare(self, normals: np.ndarray) -> tuple[float, float, float, np.ndarray]:
        """How well a mirror that faces `normals` ((m, 3) or (3,)) explains what was seen.

        Returns
        -------
        off, own : float
            Median absolute deviation of log radiance from the mirrored room, and from the elements' own means.
        together : float
            Correlation of what was seen with the mirrored room, within the elements.
        f0 : (3,) float
        """
        found = self.known(normals)
        if found is None:
            return np.inf, 0.0, 0.0, np.zeros(3)
        known, shown, a, b = found
        _, group, count = np.unique(self.element[known], return_inverse=True, return_counts=True)
        own_a, own_b = (x - (np.bincount(group, x) / count)[group] for x in (a, b))
        together = float(np.mean(own_a * own_b) / max(own_a.std() * own_b.std(), 1e-12))
        off = float(np.median(np.abs(a - b - np.median(a - b))))
        f0 = np.median(self.radiance[known] / np.maximum(shown, DARK), 0)
        return off, float(np.median(np.abs(own_a))), together, f0


def sides_of(normal: np.ndarray) -> np.ndarray:
    """Two unit vectors at right angles to a unit vector ((3,)) and to each other, (2, 3)."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    return np.stack([across, np.cross(normal, across)]) / np.linalg.norm(across)


def turned(normal: np.ndarray, sides: np.ndarray, by: np.ndarray) -> np.ndarray:
    """A unit vector ((3,)) turned towards its `sides_of` by so many times its length ((2,)), (3,) float32."""
    way = normal + by @ sides
    return (way / np.linalg.norm(way)).astype(np.float32)
