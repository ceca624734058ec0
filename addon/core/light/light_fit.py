"""The radiances under which albedo varies least within the objects, and the elements that show it.

For trial radiances s_k the albedos would be pi L_d / (E + sum s_k G_k), G_k being the irradiance that light k throws at
radiance 1. What is minimised is the mean deviation of log albedo from its object's median, each held at a cap.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from ..groups import cell_of
from ..scene.atlas import Atlas
from .params import LIGHT_FIT


def on_flat(atlas: Atlas) -> np.ndarray:
    """Elements around which the normals of their object agree, (n,) bool."""
    key = cell_of(atlas.position, LIGHT_FIT.flat_cell) * (int(atlas.object_id.max(initial=0)) + 1)
    _, group, count = np.unique(key + atlas.object_id, return_inverse=True, return_counts=True)
    total = np.stack([np.bincount(group, atlas.normal[:, k], len(count)) for k in range(3)], 1)
    return (np.linalg.norm(total, axis=1) >= LIGHT_FIT.flat * count)[group]


def log_of(sent: np.ndarray) -> np.ndarray:
    """Logarithm of radiance, which may be 0."""
    return np.log(np.maximum(sent, 1e-9))


@dataclass
class Sample:
    """m elements with a good L_d.

    Attributes
    ----------
    element : (m,) int
    object_id : (m,) int32
    radiance : (m, 3) float64
        L_d.
    received : (m, 3) float64
        E from all light known so far.
    """

    element: np.ndarray
    object_id: np.ndarray
    radiance: np.ndarray
    received: np.ndarray

    def __post_init__(self):
        _, self.group = np.unique(self.object_id, return_inverse=True)
        count = np.bincount(self.group)
        self._middle = np.cumsum(count) - count + (count - 1) // 2

    def medians(self, values: np.ndarray) -> np.ndarray:
        """For each element the median of `values` ((m,)) over its object, the lower of two in the middle, (m,)."""
        return values[np.lexsort((values, self.group))[self._middle]][self.group]

    def area(self, atlas: Atlas) -> np.ndarray:
        """Of the surface that each element stands for, (m,): its object's, shared out evenly."""
        of_object = np.bincount(atlas.object_id, atlas.weight)
        return of_object[self.object_id] / np.bincount(self.group)[self.group]

    def spread(self, log_albedo: np.ndarray) -> float:
        """Mean absolute deviation of log albedo ((m,)) from its object's median, each held at a cap."""
        return float(np.minimum(np.abs(log_albedo - self.medians(log_albedo)), LIGHT_FIT.cap).mean())

    def spread_under(self, log_sent: np.ndarray, received: np.ndarray) -> float:
        """The spread of log albedo under an E, (m,), of the logarithm of what is sent, (m,) (`log_of`)."""
        return self.spread(log_sent - np.log(received + 1e-12))

    def best(
        self, sent: np.ndarray, received: np.ndarray, contribution: np.ndarray
    ) -> tuple[float, float, float] | None:
        """The radiance s that explains best what is `sent`, with the spread before and after; None if unbounded."""
        if not (contribution > 0).any():
            return None
        sent = log_of(sent)

        def cost(log_s: float) -> float:
            return self.spread_under(sent, received + np.exp(log_s) * contribution)

        # The scale to search around: where the trial light gives as much as all known light together.
        grid = np.log(max(received.mean(), 1e-9) / contribution.mean()) + np.linspace(-5, 4, 37)
        costs = [cost(x) for x in grid]
        index = int(np.argmin(costs))
        if index == len(grid) - 1:
            return None  # more is always better: this says nothing about the light
        minimum = minimize_scalar(cost, bounds=(grid[max(index - 1, 0)], grid[index + 1]), method="bounded")
        return float(np.exp(minimum.x)), self.spread_under(sent, received), float(minimum.fun)
