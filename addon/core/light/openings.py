"""Where rays leave the room: cells on its bounding box, and the light that is known to come in by each of them.

A lamp that hangs in a hole of a scan, or a wall that was never scanned, is near: from different places it lies in
different directions, so an environment map can't hold it. A cell of the box can.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import ndimage

from ..kinds import Block, Unit
from ..luminance import LUMINANCE
from ..scene.model import Camera
from ..scene.rays import RayScene
from .environment import Environment
from .params import GATHER

CELLS = 6 * GATHER.cells**2
"""Of all six sides: side (2 * axis, + 1 for the high one), row, column."""

LOOKS: Block[int] = 1 << 20
"""Pixels, about, of all frames together of which it is asked where they look out."""

BEFORE: Unit[float] = 1e-3
"""Sizes of the box that a panel lies before a surface."""


def looked_out_by(
    cameras: Sequence[Camera], scene: RayScene, sky: Environment, usual: float, low: np.ndarray, size: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cells by which most looks of cameras inside of a box go out to where it is brighter than a `usual` luminance.

    What is no brighter than the room may be the room: a wall too far off to be in the scan.

    Returns
    -------
    windows : (CELLS,) bool
    directions : (k, 3) float32
        Some of those in which cameras look out by them.
    """
    looks, outward = np.zeros(CELLS), [np.zeros(0, int)]
    directions = [np.zeros((0, 3), np.float32)]
    for camera in cameras:
        pixels = camera.pixel_centres()
        way = camera.directions(pixels[:: max(len(pixels) * len(cameras) // LOOKS, 1)]).astype(np.float32)
        origins = np.broadcast_to(camera.centre.astype(np.float32), way.shape)
        cell = exits(low, size, origins, way)[0]
        free = (scene.intersect(origins, way).triangle < 0) & within(low, size, origins)
        free &= sky.at(sky.clipped, way) | (sky(way) @ LUMINANCE > usual)
        looks += np.bincount(cell, minlength=CELLS)
        outward.append(cell[free])
        directions.append(way[free])
    cell = np.concatenate(outward)
    windows = 2 * np.bincount(cell, minlength=CELLS) > looks
    return windows, np.concatenate(directions)[windows[cell]]


def within(low: np.ndarray, size: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points ((n, 3)) inside of a box, (n,) bool."""
    return ((points >= low) & (points <= low + size)).all(1)


def exits(
    low: np.ndarray, size: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where rays from inside the box leave it: flat cell, distance and |cosine| to the side's normal."""
    far = low + np.where(directions > 0, size, np.float32(0))
    along = np.abs(directions)
    way = np.where(along > 1e-9, np.abs(far - origins) / np.maximum(along, 1e-9), np.float32(np.inf))
    axis = way.argmin(1)
    at = np.arange(len(axis))
    distance = way[at, axis]
    point = (origins + distance[:, None] * directions - low) / size
    first, second = (axis + 1) % 3, (axis + 2) % 3
    row = np.clip((point[at, first] * GATHER.cells).astype(np.int64), 0, GATHER.cells - 1)
    column = np.clip((point[at, second] * GATHER.cells).astype(np.int64), 0, GATHER.cells - 1)
    side = 2 * axis + (directions[at, axis] > 0)
    return (side * GATHER.cells + row) * GATHER.cells + column, distance, along[at, axis]


@dataclass(frozen=True)
class Panel:
    """Bright cells that lie side by side: a lamp, or a window, that no frame saw.

    Attributes
    ----------
    corners : (q, 4, 3) float32
        Of its quads; they face the room. A triangle's last corner stands twice.
    radiance : (3,) float32
    """

    corners: np.ndarray
    radiance: np.ndarray


@dataclass(frozen=True)
class Openings:
    """Light that comes in by the cells of a box.

    Attributes
    ----------
    low, size : (3,) float32
        The box, metres.
    radiance : (CELLS, 3) float32
    share : float
        Of all the light, that which comes from there.
    windows : (CELLS,) bool
        Those that frames look out by (`looked_out_by`): what lies behind is far away, and in the environment map.
    """

    low: np.ndarray
    size: np.ndarray
    radiance: np.ndarray
    share: float = 0.0
    windows: np.ndarray = field(default_factory=lambda: np.zeros(CELLS, bool))

    def __call__(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radiance along rays that leave the mesh ((n, 3) float32), and which of them leave the box, by no window."""
        cell = exits(self.low, self.size, origins, directions)[0]
        return self.radiance[cell], within(self.low, self.size, origins) & ~self.windows[cell]

    def filled(self, sky: Environment, place: np.ndarray) -> Environment:
        """A map with these where it has no value, as a `place` ((3,)) sees them: for what knows maps alone.

        Beside what frames saw through a window the map goes on, or the window's rim would show the room's own colour.
        """
        directions = sky.directions
        start = np.broadcast_to(np.asarray(place, np.float32), directions.shape)
        shown = self(start, directions)[0].reshape(sky.radiance.shape)
        far = sky.unfamiliar if sky.seen else np.ones(sky.observations.shape, np.float32)
        # What lies behind a window is seen in other directions from other places.
        side = np.unique(np.flatnonzero(self.windows) // GATHER.cells**2)
        out = directions[:, side // 2] * np.where(side % 2, 1, -1) > 0
        far = np.where(out.any(1).reshape(far.shape), np.float32(0), far)[..., None]
        bound = np.maximum(shown, sky.radiance)
        radiance = np.where(sky.clipped[..., None], bound, (1 - far) * sky.radiance + far * shown)
        return replace(sky, radiance=radiance.astype(np.float32))

    @property
    def bright(self) -> np.ndarray:
        """Cells that are far brighter than most, (CELLS,) bool."""
        luminance = self.radiance @ LUMINANCE
        return luminance > GATHER.lamp_in_opening * np.median(luminance)

    def without_bright(self) -> Openings:
        """The same, the bright cells like most others."""
        usual = np.median(self.radiance, 0)
        return replace(self, radiance=np.where(self.bright[:, None], usual, self.radiance).astype(np.float32))

    def behind(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """The cells behind n places ((n, 3) float32) of a surface, (n,) int."""
        return exits(self.low, self.size, position, -normal)[0]

    def panels(self, closing: np.ndarray | None = None, sky: Environment | None = None) -> list[Panel]:
        """The bright cells; those that hang together, and are about as bright, as one.

        Where faces close the mesh before a cell, these shine in its stead: what was solved for came by them alone.

        Parameters
        ----------
        closing : (t, 3, 3) float32, optional
            Corners of the faces that close the mesh and that no frame saw.
        sky : Environment, optional
            What is seen through the cells where nothing closes the mesh; they give the rest, as far as no frame saw it.
        """
        faces = np.zeros((0, 3, 3), np.float32) if closing is None else _as_small(closing, float(self.size.min()))
        turned = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
        double = np.linalg.norm(turned, axis=1, keepdims=True)
        faces, normal, double = faces[double[:, 0] > 0], turned[double[:, 0] > 0], double[double[:, 0] > 0]
        normal = normal / double
        cell = self.behind(faces.mean(1), normal)
        lies = np.arange(CELLS) // GATHER.cells**2
        facing = np.abs(normal[np.arange(len(cell)), lies[cell] // 2])
        shut = np.bincount(cell, 0.5 * double[:, 0] * facing, CELLS)
        before = faces + np.float32(self.size.max() * BEFORE) * normal[:, None]
        quads = self._quads(lies, *np.divmod(np.arange(CELLS) % GATHER.cells**2, GATHER.cells))
        area = np.linalg.norm(np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]), axis=1)
        unshut = 2 * shut < area
        rest = self.radiance
        if sky is not None:
            away = quads.mean(1) - (self.low + self.size / 2)
            away = (away / np.linalg.norm(away, axis=1, keepdims=True)).astype(np.float32)
            unfamiliar = sky.at(sky.unfamiliar, away)[:, None] if sky.seen else 1
            rest = np.maximum(self.radiance - sky(away), 0) * unfamiliar
        found = []
        for own in self._alike():
            hangs = np.isin(cell, own)
            if hangs.any():
                # Of a triangle's corners the last stands twice.
                found.append(Panel(before[hangs][:, [0, 1, 2, 2]], self.radiance[own].mean(0)))
            free = own[unshut[own]]
            if len(free) and rest[free].any():
                found.append(Panel(quads[free], rest[free].mean(0)))
        return found

    def _alike(self) -> list[np.ndarray]:
        """Bright cells that lie side by side and are as bright, to the factor that makes one a lamp; flat indices."""
        luminance = self.radiance @ LUMINANCE
        step = np.log(np.maximum(luminance / max(float(np.median(luminance)), 1e-12), 1e-12))
        step = np.floor(step / np.log(GATHER.lamp_in_opening)).astype(int).reshape(6, GATHER.cells, GATHER.cells)
        bright = self.bright.reshape(step.shape)
        found = []
        for side in range(6):
            for one in np.unique(step[side][bright[side]]):
                label, count = ndimage.label(bright[side] & (step[side] == one))
                found += [np.flatnonzero(label.ravel() == k) + side * GATHER.cells**2 for k in range(1, count + 1)]
        return found

    def _quads(self, side: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Corners of some cells ((q,) int each), facing the room, (q, 4, 3) float32."""
        around = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
        around = np.where((side % 2)[:, None, None], around[::-1], around)
        axis, at = side // 2, np.arange(len(side))
        share = np.empty((len(side), 4, 3))
        share[at, :, axis] = (side % 2)[:, None]
        share[at, :, (axis + 1) % 3] = (row[:, None] + around[..., 0]) / GATHER.cells
        share[at, :, (axis + 2) % 3] = (column[:, None] + around[..., 1]) / GATHER.cells
        return (self.low + share * self.size).astype(np.float32)


def _as_small(faces: np.ndarray, size: float) -> np.ndarray:
    """Triangles ((t, 3, 3)) in parts no larger than the cells of a box of that size, (s, 3, 3) float32."""
    done = []
    while len(faces):
        large = np.linalg.norm(faces - np.roll(faces, 1, 1), axis=2).max(1) > 2 * size / GATHER.cells
        done.append(faces[~large])
        a, b, c = faces[large].transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = np.concatenate([np.stack(part, 1) for part in parts])
    return np.concatenate([*done, np.zeros((0, 3, 3))]).astype(np.float32)
