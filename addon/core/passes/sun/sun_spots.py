"""Elements near a patch of light, and how well a sun explains them: by the objects' albedo, and along the edges."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...light.field import LightField
from ...light.light_fit import Sample
from ...light.params import LESS_NOISE, LIGHT_FIT
from ...light.sun import Sun, shadow
from ...luminance import LUMINANCE
from ...scene.rays import RayScene
from .params import SUN


def visible(scene: RayScene, direction: np.ndarray, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Cosine of a direction where nothing hides it, else 0, (n,) float32."""
    cosine = np.maximum(normal @ np.asarray(direction, np.float32), 0)
    facing = np.flatnonzero(cosine > 0)
    directions = np.broadcast_to(np.float32(direction), (len(facing), 3))
    origins = scene.off_surface(position[facing], normal[facing])
    cosine[facing[scene.occluded(origins, directions, np.full(len(facing), np.inf, np.float32))]] = 0
    return cosine


@dataclass(frozen=True)
class Guess:
    """A sun as far as it is known.

    Attributes
    ----------
    direction : (3,) float32
    cost : float
        What is left of the quantity that was minimised.
    strength : float
        Irradiance, luminance.
    """

    direction: np.ndarray
    cost: float
    strength: float = 0.0
    radius: float = 0.0


class Spots:
    """Elements and what is known of them; asks for shadows.

    Parameters
    ----------
    element : (m,) int
    received : (m, 3) float64
        E there, without the sun.
    """

    def __init__(self, field: LightField, element: np.ndarray, received: np.ndarray):
        atlas = field.atlas
        self.scene, self.atlas = field.scene, atlas
        self.position, self.normal = atlas.position[element], atlas.normal[element]
        self.sample = Sample(element, atlas.object_id[element], field.radiance[element].astype(np.float64), received)
        self.edge = atlas.texel_edge

    def __len__(self) -> int:
        return len(self.position)

    def log_albedo(
        self, contribution: np.ndarray | float = 0.0, strength: float = 0.0, weights=LUMINANCE
    ) -> np.ndarray:
        """Of the channel that `weights` make, with a sun, (m,)."""
        sent = np.pi * (self.sample.radiance @ weights)
        received = self.sample.received @ weights + strength * contribution
        return np.log(np.maximum(sent, 1e-12)) - np.log(np.maximum(received, 1e-12))

    def over(self, contribution: np.ndarray | float = 0.0, strength: float = 0.0) -> np.ndarray:
        """Elements short of light, (m,) bool."""
        return self.log_albedo(contribution, strength) > np.log(SUN.over)

    def stands_out(self) -> np.ndarray:
        """Those, and what is much brighter than the rest of its object, (m,) bool."""
        value = self.log_albedo()
        return self.over() | (value - self.medians(value, np.ones(len(self), bool)) > SUN.stands_out)

    def contribution(self, direction: np.ndarray, radius: float = 0.0) -> np.ndarray:
        """E at an irradiance of 1, (m,) float32; without a radius that of a point in the sky."""
        if radius:
            return shadow(self.scene, Sun(direction, np.ones(3), radius), self.position, self.normal, self.edge, 0)[0]
        return visible(self.scene, direction, self.position, self.normal)

    def medians(self, values: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """For each element the median of `values` over the chosen ones of its object, (m,); NaN where none is."""
        group = self.sample.group
        order = np.flatnonzero(chosen)[np.lexsort((values[chosen], group[chosen]))]
        count = np.bincount(group[chosen], minlength=int(group.max(initial=0)) + 1)
        median = np.full(len(count), np.nan)
        start = np.concatenate([[0], np.cumsum(count)[:-1]])
        median[count > 0] = values[order[(start + count // 2)[count > 0]]]
        return median[group]

    def strength(self, contribution: np.ndarray, weights=LUMINANCE) -> float:
        """Irradiance that makes what is lit as bright as it is, if its albedo is that of its object's shaded rest."""
        lit = contribution > 0
        rho = np.exp(self.medians(self.log_albedo(weights=weights), contribution <= 0))
        use = lit & np.isfinite(rho)
        if use.sum() < 3:
            return 0.0
        sent, received = np.pi * (self.sample.radiance @ weights), self.sample.received @ weights
        return max(float(np.median((sent[use] / rho[use] - received[use]) / contribution[use])), 0.0)

    def spread(self, contribution: np.ndarray | float = 0.0, strength: float = 0.0) -> float:
        return self.sample.spread(self.log_albedo(contribution, strength))

    def explained(self, direction: np.ndarray) -> Guess:
        """The direction with its strength and the spread that it leaves."""
        contribution = self.contribution(direction)
        strength = self.strength(contribution)
        return Guess(direction, self.spread(contribution, strength), strength)


class Edges:
    """Neighbours on the same object along the edges of a patch: light and shade that are right leave them alike."""

    def __init__(self, spots: Spots):
        self.spots = spots
        key = np.concatenate([spots.position, 0.2 * spots.normal, 100.0 * spots.sample.group[:, None]], 1)
        distance, neighbour = cKDTree(key).query(key, k=min(9, len(key)), distance_upper_bound=LESS_NOISE.cell)
        self.a, k = np.nonzero(np.isfinite(distance[:, 1:]))
        self.b = neighbour[:, 1:][self.a, k]

    def differ(self, contribution: np.ndarray | float = 0.0, strength: float = 0.0) -> float:
        """Mean difference of log albedo between neighbours, each held at `COARSE`."""
        value = self.spots.log_albedo(contribution, strength)
        return float(np.minimum(np.abs(value[self.a] - value[self.b]), LIGHT_FIT.cap).mean()) if len(self.a) else 0.0

    def explained(self, direction: np.ndarray, strength: float, radius: float) -> Guess:
        return Guess(direction, self.differ(self.spots.contribution(direction, radius), strength), strength, radius)
