"""What frames saw of a mirror, against the room as a mirror of a tried normal would show it."""

from __future__ import annotations

from dataclasses import dataclass, replace

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
    least : int
        Fewer say nothing. It is lower for what was found to mirror before.
    """

    field: LightField
    element: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    radiance: np.ndarray
    least: int = LEVELS.many

    @staticmethod
    def of(field: LightField, samples: Samples, index: np.ndarray, least: int = LEVELS.many) -> Views:
        """Those of `samples` ((m,) int indices)."""
        element = samples.element[index]
        origin = field.scene.off_surface(field.atlas.position[element], field.atlas.normal[element])
        return Views(field, element, origin, samples.direction[index], samples.radiance[index], least)

    def __len__(self) -> int:
        return len(self.element)

    def part(self, index: np.ndarray) -> Views:
        """The observations at `index`."""
        names = "element", "origin", "direction", "radiance"
        return replace(self, **{name: getattr(self, name)[index] for name in names})

    def known(self, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
        """Observations ((k,) int) whose mirrored direction is known under `normals`, the radiance from there ((k, 3)),
        and the logarithms of the observed and of the predicted radiance, (k,) each; None for fewer than `least`."""
        twice_cosine = (
            2 * np.einsum("ij,ij->i", self.direction, np.broadcast_to(normals, self.direction.shape))[:, None]
        )
        predicted = self.field.along(self.origin, (twice_cosine * normals - self.direction).astype(np.float32))[0]
        known = np.flatnonzero(predicted.mean(1) > DARK)
        if len(known) < self.least:
            return None
        observed, predicted = self.radiance[known], predicted[known]
        return known, predicted, *(np.log(np.maximum(x.mean(1), DARK)) for x in (observed, predicted))

    def deviation(self, normal: np.ndarray) -> float:
        """Mean absolute deviation of log radiance from a mirror of one normal ((3,)); inf where too little is known."""
        known = self.known(normal)
        if known is None:
            return np.inf
        ratio = known[2] - known[3]
        # Beside an edge a ray of a slightly different direction meets another surface altogether.
        return float(np.minimum(np.abs(ratio - np.median(ratio)), MIRRORS.stray).mean())

    def compare(self, normals: np.ndarray) -> tuple[float, float, float, np.ndarray]:
        """How well a mirror that faces `normals` ((m, 3) or (3,)) explains what was seen.

        Returns
        -------
        deviation, own_deviation : float
            Median absolute deviation of log radiance from the mirrored room, and from the elements' own means: of
            elements seen more than once, as others have no deviation.
        correlation : float
            Of what was seen with the mirrored room, within the elements.
        f0 : (3,) float
        """
        result = self.known(normals)
        if result is None:
            return np.inf, 0.0, 0.0, np.zeros(3)
        known, predicted, a, b = result
        _, group, count = np.unique(self.element[known], return_inverse=True, return_counts=True)
        centred_a, centred_b = (x - (np.bincount(group, x) / count)[group] for x in (a, b))
        correlation = float(np.mean(centred_a * centred_b) / max(centred_a.std() * centred_b.std(), 1e-12))
        f0 = np.median(self.radiance[known] / np.maximum(predicted, DARK), 0)
        several = (count > 1)[group]
        if several.sum() < LEVELS.few:
            return np.inf, 0.0, correlation, f0
        deviation = float(np.median(np.abs(a - b - np.median(a - b))[several]))
        return deviation, float(np.median(np.abs(centred_a)[several])), correlation, f0


def tangents_of(normal: np.ndarray) -> np.ndarray:
    """Two unit vectors at right angles to a unit vector ((3,)) and to each other, (2, 3)."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    return np.stack([across, np.cross(normal, across)]) / np.linalg.norm(across)


def turned(normal: np.ndarray, tangents: np.ndarray, tilt: np.ndarray) -> np.ndarray:
    """A unit vector ((3,)) turned towards its `tangents_of` by multiples of its length ((2,)), (3,) float32."""
    direction = normal + tilt @ tangents
    return (direction / np.linalg.norm(direction)).astype(np.float32)
