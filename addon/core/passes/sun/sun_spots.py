"""Elements near a patch of light, and how well a sun explains what lies along its edges."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import CensoredData, ecdf

from ...light.field import LightField
from ...light.light_fit import Sample
from ...light.params import LIGHT_FIT
from ...light.sun import Sun, around, shadow
from ...luminance import LUMINANCE
from ...scene.rays import RayScene
from ...scene.tangent_frame import tangent_frame
from ...significance import LEVELS
from .params import SUN

RADII = np.radians([0.27, 0.5, 0.75, 1.0])
"""Discs that are tried: thin clouds, and pictures and meshes that are not sharp, soften the edges."""


def ring(direction: np.ndarray, radius: float, count: int = 8) -> np.ndarray:
    """Unit directions on a circle of `radius` radians around one, (count, 3) float32."""
    angle = np.arange(count) * (2 * np.pi / count)
    return around(direction, radius * np.stack([np.cos(angle), np.sin(angle)], 1))


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
        Of what is minimised.
    strength : float
        Irradiance, luminance.
    radius : float
        Of the disc, radians.
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
    object_id, lower : (n,) int, (n, 3) bool
        Of all elements of the room: the object; which channels of the radiance are lower bounds.
    """

    def __init__(
        self, field: LightField, element: np.ndarray, received: np.ndarray, object_id: np.ndarray, lower: np.ndarray
    ):
        atlas = field.atlas
        self.scene = field.scene
        self.position, self.normal = atlas.position[element], atlas.normal[element]
        self.sample = Sample(element, object_id[element], field.radiance[element].astype(np.float64), received)
        self.lower = lower[element]
        self.clipped = self.lower.any(1)
        self.edge = atlas.texel_edge

    @property
    def place(self) -> np.ndarray:
        """A key, (m, 7): the distance between two is that of elements of one object; others are far apart."""
        return np.concatenate([self.position, 0.2 * self.normal, 100.0 * self.sample.object_id[:, None]], 1)

    def __len__(self) -> int:
        return len(self.position)

    def log_albedo(
        self, contribution: np.ndarray | float = 0.0, strength: float = 0.0, weights: np.ndarray = LUMINANCE
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
        return self.over() | (value - self.sample.medians(value) > SUN.stands_out)

    def raised(self, contribution: np.ndarray, strength: float) -> float:
        """How much a sun raises log E of what it lights, in the median; 0 if it lights nothing."""
        rise = (self.log_albedo() - self.log_albedo(contribution, strength))[contribution > 0]
        return float(np.median(rise)) if len(rise) else 0.0

    def contribution(self, direction: np.ndarray, radius: float = 0.0) -> np.ndarray:
        """E at an irradiance of 1, (m,) float32; without a radius that of a point in the sky."""
        if radius:
            return shadow(self.scene, Sun(direction, np.ones(3), radius), self.position, self.normal, self.edge, 0)[0]
        return visible(self.scene, direction, self.position, self.normal)

    def lit_around(self, direction: np.ndarray, margin: float) -> np.ndarray:
        """Whether places `margin` metres beside the elements, and they from around a direction, are lit, (16, m)."""
        right, up = tangent_frame(self.normal)
        angle = np.arange(8)[:, None, None] * (np.pi / 4)
        beside = self.position + np.float32(margin * (np.cos(angle) * right + np.sin(angle) * up))
        places = [visible(self.scene, direction, place, self.normal) for place in beside]
        return np.stack(places + [self.contribution(towards) for towards in ring(direction, RADII[-1])]) > 0


class Edges:
    """Neighbours on the same object along the edges of a patch: light and shade that are right leave them alike.

    Of a clipped element only a lower bound of its albedo is known: it may be as much brighter as the light asks for.
    """

    def __init__(self, spots: Spots):
        self.spots = spots
        place = spots.place
        distance, neighbour = cKDTree(place).query(place, k=min(9, len(place)), distance_upper_bound=SUN.near)
        self.a, k = np.nonzero(np.isfinite(distance[:, 1:]))
        self.b = neighbour[:, 1:][self.a, k]

    def _difference(
        self, a: np.ndarray, b: np.ndarray, contribution: np.ndarray | float = 0.0, strength: float = 0.0
    ) -> float:
        """Mean of log albedo's between elements at `a` and `b` ((k,) int), each held at a cap; 0 if there are none."""
        if not len(a):
            return 0.0
        value, clipped = self.spots.log_albedo(contribution, strength), self.spots.clipped
        difference = value[a] - value[b]
        difference[(clipped[a] & (difference < 0)) | (clipped[b] & (difference > 0))] = 0
        return float(np.minimum(np.abs(difference), LIGHT_FIT.cap).mean())

    def _two_sides(self, direction: np.ndarray, lit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What a direction lights ((m,) bool) and the nearest in its shade, all off the shadow's edge, (k,) int each.

        Beside the edge the lit look dark, and so are the last to be clipped, the others bright. Where sun falls on
        bars and reveals alone nothing is as far from an edge, and what is nearer has to do.
        """
        place = self.spots.place
        for margin in (SUN.margin, SUN.margin / 2, SUN.margin / 4):
            lit_around = self.spots.lit_around(direction, margin)
            bright = np.flatnonzero(lit & lit_around.all(0))
            shade = np.flatnonzero(~lit & ~lit_around.any(0) & ~self.spots.clipped)
            distance, nearest = cKDTree(place[shade]).query(place[bright], distance_upper_bound=SUN.near)
            near = np.isfinite(distance)
            a, b = bright[near], shade[nearest[near]]
            if len(a) >= LEVELS.enough:
                break
        return a, b

    def explained(self, direction: np.ndarray, strength: float, radius: float) -> Guess:
        """A sun, with the mean difference of neighbours under it."""
        cost = self._difference(self.a, self.b, self.spots.contribution(direction, radius), strength)
        return Guess(direction, cost, strength, radius)

    def without_sun(self) -> float:
        """The mean difference of neighbours without a sun."""
        return self._difference(self.a, self.b)

    def across(self, guess: Guess) -> tuple[float, float]:
        """Mean difference of the neighbours that are on two sides of a shadow's edge, without the sun and with it."""
        lit = self.spots.contribution(guess.direction) > 0
        two_sides = lit[self.a] != lit[self.b]
        return self._compared(self.a[two_sides], self.b[two_sides], guess)

    def off_edge(self, guess: Guess) -> tuple[float, float]:
        """The same of what is lit and the nearest in shade, both off the edge."""
        return self._compared(*self._two_sides(guess.direction, self.spots.contribution(guess.direction) > 0), guess)

    def _compared(self, a: np.ndarray, b: np.ndarray, guess: Guess) -> tuple[float, float]:
        """Mean difference between elements at `a` and `b` without the sun and with it."""
        contribution = self.spots.contribution(guess.direction, guess.radius)
        return self._difference(a, b), self._difference(a, b, contribution, guess.strength)

    def contrast(self, direction: np.ndarray) -> Guess:
        """How much brighter what a direction lights is than neighbours in its shade: the cost is less their z-score.

        Whatever their texture and other light are, as neither keeps to the edges of that shade.
        """
        lit = self.spots.contribution(direction) > 0
        mixed = lit[self.a] & ~lit[self.b]
        value = self.spots.log_albedo()
        difference = np.clip(value[self.a[mixed]] - value[self.b[mixed]], -LIGHT_FIT.cap, LIGHT_FIT.cap)
        return Guess(direction, -float(difference.sum() / np.sqrt(max(mixed.sum(), 1))))

    def strengths(self, direction: np.ndarray, bounds: bool = True) -> np.ndarray:
        """Irradiance that makes what is lit like the nearest in shade: each channel's, and luminance's, (4,).

        Of luminance the median by Kaplan and Meier (1958), as a clipped element gives a lower bound; of a channel its
        median share of what is not clipped. Where that is too little, by channels that clipped elements tell
        (`measured`); else white, where all is clipped by the median bound; 0 if unknown. Without `bounds` it is also
        unknown where most of what is lit is clipped.
        """
        needed, lower = self._needed(direction)
        clipped = lower.any(1)
        if not len(needed) or not bounds and 2 * np.count_nonzero(clipped) > len(clipped):
            return np.zeros(4)
        channels, measured = _despite_clipping(needed, lower)
        if measured.any():
            # As bright as those that are, unless the bounds are above that.
            channels[~measured] = np.maximum(channels[~measured], channels[measured].max())
            return np.maximum([*channels, channels @ LUMINANCE], 0)
        luminance = needed[:, 3]
        unclipped = ~clipped & (luminance > 0)
        if not unclipped.any():
            return np.full(4, max(np.median(luminance), 0))
        strength, _ = _censored_median(luminance, clipped)
        shares = [1.0] * 3
        if unclipped.sum() >= LEVELS.few:
            shares = [np.median(needed[unclipped, k] / luminance[unclipped]) for k in range(3)]
        return np.maximum(strength * np.array([*shares, 1]), 0)

    def measured(self, direction: np.ndarray) -> np.ndarray:
        """Channels whose strength is known though all but a few of what is lit have others clipped, (3,) bool."""
        return _despite_clipping(*self._needed(direction))[1]

    def _needed(self, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance that each lit element beside shade needs to be like that, in three channels and luminance, (k, 4).

        And which of the channels are lower bounds, (k, 3) bool. None where there are too few.
        """
        spots = self.spots
        contribution = spots.contribution(direction)
        a, b = self._two_sides(direction, contribution > 0)
        if len(a) < LEVELS.enough:
            return np.zeros((0, 4)), np.zeros((0, 3), bool)
        needed = []
        for weights in (*np.eye(3), LUMINANCE):
            value, received = spots.log_albedo(weights=weights), spots.sample.received @ weights
            needed.append(received[a] * (np.exp(value[a] - value[b]) - 1) / contribution[a])
        return np.stack(needed, 1), spots.lower[a]


def _despite_clipping(needed: np.ndarray, lower: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each channel's strength where all but a few are clipped, (3,), and whether they tell it all the same, (3,) bool.

    Where not, the median bound. `needed` and `lower` as by `Edges._needed`.
    """
    clipped = lower.any(1)
    unclipped = np.count_nonzero(~clipped & (needed[:, 3] > 0))
    if unclipped >= LEVELS.few or 2 * np.count_nonzero(clipped) <= len(clipped):
        return np.zeros(3), np.zeros(3, bool)
    channels, measured = zip(*(_censored_median(needed[:, k], lower[:, k]) for k in range(3)), strict=True)
    return np.where(measured, channels, np.median(needed[:, :3], 0)), np.array(measured)


def _censored_median(values: np.ndarray, censored: np.ndarray) -> tuple[float, bool]:
    """The median of values of which some are lower bounds (Kaplan and Meier 1958), and whether many tell it.

    Else the greatest that is no bound, or the median bound.
    """
    exact = ~censored & (values > 0)
    if not exact.any():
        return float(np.median(values)), False
    survival = ecdf(CensoredData.right_censored(values, censored)).sf
    half = np.flatnonzero(survival.probabilities <= 0.5)
    if not len(half):
        return float(values[exact].max()), False
    return float(survival.quantiles[half[0]]), bool(exact.sum() >= LEVELS.enough)
