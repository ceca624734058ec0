"""Light from outside: radiance by direction, from the frames' own pixels that see past the mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from ..scene.model import Pixels
from ..scene.visibility import FrameView
from .params import LIGHT_FIT, SKY

NEAR = np.radians(8)
"""Angle over which what was seen of the sky says something of its surroundings."""
BESIDE = np.radians(3)
"""Angle over which it continues as it was seen."""


@dataclass(frozen=True)
class Zone:
    """A part of the sky whose radiance is not known but for its pattern.

    Attributes
    ----------
    weight : (h, 2h) float32
        How far each direction belongs to it, 0...1.
    pattern : (h, 2h) float32
        Its radiance at a mean of 1, times the weight.
    measured : bool
        Frames show radiance on its side of the horizon.
    clipped : bool
        Of what frames saw of it only a lower bound is known.
    """

    weight: np.ndarray
    pattern: np.ndarray
    measured: bool = False
    clipped: bool = False


def _by_solid_angle(weight: np.ndarray) -> np.ndarray:
    """Weights ((h, 2h)) times the relative solid angle of each row."""
    height = len(weight)
    return np.cos((np.arange(height) + 0.5) / height * np.pi - np.pi / 2)[:, None] * weight


def _levelled(pattern: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The pattern, scaled so that its mean over the weights is 1."""
    return (pattern * (_by_solid_angle(weight).sum() / max(_by_solid_angle(pattern).sum(), 1e-20))).astype(np.float32)


@dataclass(frozen=True)
class Environment:
    """A directional map, infinitely far away.

    Attributes
    ----------
    radiance : (h, 2h, 3) float32
        Equirectangular, row 0 at the bottom; u = 0.5 - atan2(y, x) / (2 pi), v = 0.5 + asin(z) / pi. Linear Rec.709.
    observations : (h, 2h) int32
        Pixels behind each direction; 0 where `radiance` was filled in from neighbours.
    clipped : (h, 2h) bool
        Every one of those was clipped: `radiance` is a lower bound. Nothing, unless given.
    """

    radiance: np.ndarray
    observations: np.ndarray
    clipped: np.ndarray = None  # type: ignore[assignment]  # put right below

    def __post_init__(self):
        if self.clipped is None:
            object.__setattr__(self, "clipped", np.zeros(self.observations.shape, bool))

    @property
    def seen(self) -> bool:
        """Whether any frame saw the outside at all."""
        return bool(self.observations.any())

    @property
    def measured(self) -> np.ndarray:
        """Directions whose radiance frames show: seen, and not clipped; (h, 2h) bool."""
        return (self.observations > 0) & ~self.clipped

    @staticmethod
    def dark() -> Environment:
        """No light from outside."""
        return Environment(np.zeros((1, 2, 3), np.float32), np.zeros((1, 2), np.int32))

    @staticmethod
    def only(pattern: np.ndarray) -> Environment:
        """Radiance as `pattern` ((h, 2h) float32) has it, in all channels alike."""
        return Environment(np.repeat(pattern[..., None], 3, -1).astype(np.float32), np.zeros(pattern.shape, np.int32))

    @cached_property
    def strange(self) -> np.ndarray:
        """How little what frames saw says of each direction: 0 where they saw it, towards 1 far away; (h, 2h) float32.

        Near what was seen the neighbours' radiance is as good a guess as any.
        """
        return (1 - np.exp(-self._to(self.observations > 0)[0] / NEAR)).astype(np.float32)

    @cached_property
    def unfamiliar(self) -> np.ndarray:
        """The same over a few degrees only, as a window's rim hides of the sky behind; (h, 2h) float32.

        A clipped sky may be a hundred times as bright as the room: a hundredth of it would still show. What frames saw
        through a crack, narrower than three of the map's cells, may be the wall itself: it says nothing of what is
        beside it.
        """
        seen = self.observations > 0
        wide = self._wide(seen)
        if not wide.any():
            return (~seen).astype(np.float32)
        distance = self._to(wide)[0]
        return np.where(seen, 0, 1 - np.exp(-((distance / BESIDE) ** 2))).astype(np.float32)

    def _wide(self, chosen: np.ndarray) -> np.ndarray:
        """Those of some directions ((h, 2h) bool) that are of spots at least three cells wide."""
        width = chosen.shape[1]  # directions wrap around
        return ndimage.binary_opening(np.concatenate([chosen] * 3, 1), np.ones((3, 3)))[:, width:-width]

    def _to(self, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radians from each direction to the nearest that was `seen` ((h, 2h) bool), and its flat index."""
        height, width = seen.shape
        tiled = np.concatenate([~seen] * 3, 1)  # directions wrap around
        distance, (row, column) = ndimage.distance_transform_edt(tiled, return_indices=True)
        middle = np.s_[:, width : 2 * width]
        return distance[middle] * (np.pi / height), (row * width + column % width)[middle]

    def clipped_parts(self, angle: float) -> np.ndarray:
        """Parts of what is clipped, cells of so many radians either way; (h, 2h) int from 0, -1 where it is not.

        Unseen directions belong to what the nearest seen one does. What is narrower than three of the map's cells and
        not clipped may hold a window's rim, and says nothing of them.
        """
        height, width = self.observations.shape
        row, column = np.mgrid[:height, :width]
        cell = max(int(round(angle / np.pi * height)), 1)
        part = np.full(height * width, -1)
        chosen = self.clipped.ravel()
        if chosen.any():
            cell_number = (row // cell * width + column // cell).ravel()[chosen]
            part[chosen] = np.unique(cell_number, return_inverse=True)[1].ravel()
        part, known = part.reshape(height, width), self.clipped | self._wide(self.measured)
        return np.where(self.observations > 0, part, part.ravel()[self._to(known)[1]]) if known.any() else part

    def shown_in(self, directions: np.ndarray) -> Environment:
        """The map as if frames had seen only what lies in some `directions` ((k, 3)), and beside those."""
        chosen = np.zeros(self.observations.shape, bool)
        chosen.ravel()[_bin(directions, len(chosen))] = True
        chosen = ndimage.binary_dilation(chosen, np.ones((3, 3)))
        count = np.where(chosen, self.observations, 0)
        return Environment(_filled(self.radiance, count), count, self.clipped & chosen)

    def at(self, image: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """What an image of the map's size ((h, 2h, ...)) has in unit `directions` ((n, 3)), (n, ...)."""
        height, width = self.observations.shape
        return image.reshape(height * width, *image.shape[2:]).take(_bin(directions, height), 0)

    def with_clipped(self, part: np.ndarray, radiance: np.ndarray) -> Environment:
        """The map whose clipped `part` k ((h, 2h) int, `clipped_parts`) has the mean radiance k ((k, 3)).

        Its pattern stays that of the bounds; what no frame saw is filled in anew.
        """
        level = self.mean_of(part, len(radiance))
        factor = np.concatenate([radiance / np.maximum(level, 1e-12), np.ones((1, 3))])
        return self.refilled((self.radiance * factor[np.where(self.clipped, part, -1)]).astype(np.float32))

    def mean_of(self, part: np.ndarray, count: int) -> np.ndarray:
        """Mean of what is clipped in each `part` of so many, (count, 3) float64."""
        weight = _by_solid_angle(self.clipped)
        part_of_cell = np.where(self.clipped, part, count).ravel()
        total = np.bincount(part_of_cell, weight.ravel(), count + 1)[:count]
        summed = [
            np.bincount(part_of_cell, (weight * self.radiance[..., k]).ravel(), count + 1)[:count] for k in range(3)
        ]
        return np.stack(summed, 1) / np.maximum(total, 1e-20)[:, None]

    def unknown_zones(self) -> list[Zone]:
        """The directions above and below the horizon that frames don't show; last, what of the rest they clipped.

        The weight is `strange`. Within a zone radiance goes with the height as it does where the frames saw it: skies
        change more with the height than around. Where frames clipped most of what they saw on a side, that and the
        unseen are one zone, as unknowns that light a room alike can't be told apart, but for a band above the horizon,
        which reaches deepest into a room.
        """
        weight, height = self.strange, len(self.observations)
        row, profile = np.arange(height)[:, None], self._profile()[:, None]
        above, low = row >= height / 2, row < (0.5 + SKY.band / 180) * height
        zones: list[Zone] = []
        remaining = self.clipped
        for side in (above, ~above):
            zone_weight, known = np.where(side, weight, np.float32(0)), self.measured & side
            if _by_solid_angle(self.clipped & side).sum() > _by_solid_angle(known).sum():
                zone_weight, remaining = np.where(side & self.clipped, np.float32(1), zone_weight), remaining & ~side
                parts = [np.where(part, zone_weight, np.float32(0)) for part in (low, ~low)]
                zones.extend(Zone(part, part, clipped=True) for part in parts if part.any())
            elif zone_weight.any():
                zones.append(Zone(zone_weight, _levelled(zone_weight * profile, zone_weight), bool(known.any())))
        if remaining.any():
            zones.append(Zone(remaining.astype(np.float32), remaining.astype(np.float32), clipped=True))
        return zones

    def _profile(self) -> np.ndarray:
        """Median luminance of what frames saw at each height, (h,) float32; of the nearest height that they saw."""
        height = len(self.observations)
        observed = self.measured
        rows = np.flatnonzero(observed.any(1))
        if not len(rows):
            return np.ones(height, np.float32)
        level = [np.median(self.radiance[row, observed[row]].mean(1)) for row in rows]
        profile = np.interp(np.arange(height), rows, level)
        profile = ndimage.gaussian_filter1d(profile, np.radians(SKY.profile) / np.pi * height, mode="nearest")
        middle = max(float(np.median(profile[rows])), 1e-12)
        return np.clip(profile / middle, 1 / LIGHT_FIT.reach, LIGHT_FIT.reach).astype(np.float32)

    def zone_mean(self, zone: Zone) -> np.ndarray:
        """Mean radiance over a zone, weighted by solid angle: (3,) float32."""
        share = _by_solid_angle(zone.weight)
        return (self.radiance * share[..., None]).sum((0, 1)) / max(share.sum(), 1e-12)

    def with_zone(self, zone: Zone, radiance: np.ndarray) -> Environment:
        """The same map with a mean `radiance` ((3,)) mixed in by the weights of a zone, in its pattern."""
        mixed = self.radiance * (1 - zone.weight[..., None]) + zone.pattern[..., None] * radiance
        return Environment(mixed.astype(np.float32), self.observations, self.clipped)

    def __call__(self, directions: np.ndarray) -> np.ndarray:
        """Radiance from unit `directions` ((n, 3) float32, away from the room): (n, 3) float32."""
        return self.at(self.radiance, directions)

    @property
    def directions(self) -> np.ndarray:
        """Unit directions through the middles of the map's cells, (height * width, 3) float32: `_bin`'s inverse."""
        height, width = self.radiance.shape[:2]
        row, column = np.mgrid[:height, :width] + 0.5
        longitude, latitude = (0.5 - column / width) * 2 * np.pi, (row / height - 0.5) * np.pi
        cosine = np.cos(latitude)
        directions = np.stack([cosine * np.cos(longitude), cosine * np.sin(longitude), np.sin(latitude)], -1)
        return directions.reshape(-1, 3).astype(np.float32)

    def refilled(self, radiance: np.ndarray) -> Environment:
        """The map with another `radiance` where frames saw it; the rest is filled in from that."""
        return Environment(_filled(radiance, self.observations), self.observations, self.clipped)


def _bin(directions: np.ndarray, height: int) -> np.ndarray:
    """Flat index of the map's cell that each direction falls in."""
    width = 2 * height
    u = 0.5 - np.arctan2(directions[:, 1], directions[:, 0]) * np.float32(0.5 / np.pi)
    v = 0.5 + np.arcsin(np.clip(directions[:, 2], -1, 1)) * np.float32(1 / np.pi)
    column = np.minimum((u * width).astype(np.int32), width - 1)
    return np.minimum((v * height).astype(np.int32), height - 1) * width + column


def _filled(radiance: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Unseen directions from seen ones; those below the horizon from below it, those above it from above.

    The ground's radiance says nothing of the sky's. Filled in across the horizon, what the light showed of the ground
    was .73, .55 and a third (its bound) of the guess in three rooms, and where it showed nothing .9 stood for .5.
    """
    half = len(weight) // 2
    if not half or not (weight[:half] > 0).any() or not (weight[half:] > 0).any():
        return _fill(radiance, weight)
    return np.concatenate([_fill(radiance[part], weight[part]) for part in (slice(half), slice(half, None))])


def _fill(radiance: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Pull-push: unseen cells take the mean of the nearest coarser neighbourhood that has any."""
    height, width = weight.shape
    if height == 1 or (weight > 0).all():
        if not (weight > 0).any():
            return np.zeros_like(radiance)
        mean = (radiance * weight[..., None]).sum((0, 1)) / weight.sum()
        return np.where(weight[..., None] > 0, radiance, mean).astype(np.float32)
    seen = (weight > 0).astype(np.float32)
    small_weight = seen.reshape(height // 2, 2, width // 2, 2).sum((1, 3))
    small_sum = (radiance * seen[..., None]).reshape(height // 2, 2, width // 2, 2, 3).sum((1, 3))
    small = _fill(small_sum / np.maximum(small_weight, 1)[..., None], small_weight)
    return np.where(seen[..., None] > 0, radiance, small.repeat(2, 0).repeat(2, 1)).astype(np.float32)


class EnvironmentAccumulator:
    """Collects escaped pixels frame by frame; give `add` to `accumulate(also=...)`.

    Parameters
    ----------
    pixel_angle : float
        Radians that one pixel of the frames covers; sets the map's resolution (at most `max_height` rows).
    """

    def __init__(self, pixel_angle: float):
        height = np.pi / max(pixel_angle, 1e-6)
        self._height = int(min(SKY.max_height, 2 ** np.round(np.log2(max(height, 16)))))
        cells = 2 * self._height**2
        self._sum = np.zeros((cells, 3))
        self._count = np.zeros(cells, np.int64)
        self._bound = np.zeros((cells, 3), np.float32)
        self._bounds = np.zeros(cells, np.int64)

    def add(self, view: FrameView, pixels: Pixels) -> None:
        """Take the pixels whose whole neighbourhood escapes (an edge mixes in the window frame)."""
        outside = (view.triangle < 0) & view.clean & pixels.valid
        if not outside.any():
            return
        directions = view.camera.directions(view.camera.pixel_centres()[outside.ravel()])
        cells = _bin(directions, self._height)
        radiance, clipped = pixels.radiance[outside], pixels.saturated[outside]
        np.maximum.at(self._bound, cells[clipped], radiance[clipped])
        np.add.at(self._bounds, cells[clipped], 1)
        # Of the frame's cells alone: sums over the whole map took four times as long.
        used, index = np.unique(cells[~clipped], return_inverse=True)
        self._sum[used] += np.stack([np.bincount(index, plane, len(used)) for plane in radiance[~clipped].T], -1)
        self._count[used] += np.bincount(index, minlength=len(used))

    def result(self) -> Environment:
        """The map, unseen directions filled in from their neighbours; of clipped ones the greatest lower bound.

        A direction is clipped if most of its observations are, and the others don't show more than those allow.
        """
        shape = (self._height, 2 * self._height)
        mean = self._sum / np.maximum(self._count, 1)[:, None]
        # Codes just below the greatest, as a JPEG has them in a white sky, contradict what the clipped ones bound.
        contradicted = (self._bounds >= self._count) & (mean.mean(1) < self._bound.mean(1))
        clipped = (self._bounds > 0) & ((self._count == 0) | contradicted)
        mean = np.where(clipped[:, None], self._bound, mean).astype(np.float32).reshape(*shape, 3)
        count = np.where(clipped, self._bounds, self._count).reshape(shape).astype(np.int32)
        return Environment(_filled(mean, count), count, clipped.reshape(shape))
