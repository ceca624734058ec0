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

PIXELS: Block[int] = 1 << 20
"""Pixels, about, of all frames together that are traced to where they look out."""

PANEL_OFFSET: Unit[float] = 1e-3
"""Sizes of the box that a panel lies before a surface."""


def looked_out_by(
    cameras: Sequence[Camera], scene: RayScene, sky: Environment, typical: float, low: np.ndarray, size: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cells by which most rays of cameras inside of a box go out to where it is brighter than a `typical` luminance.

    What is no brighter than the room may be the room: a wall too far off to be in the scan.

    Returns
    -------
    windows : (CELLS,) bool
    directions : (k, 3) float32
        Some of those in which cameras look out by them.
    """
    rays, outward_cells = np.zeros(CELLS), [np.zeros(0, int)]
    directions = [np.zeros((0, 3), np.float32)]
    for camera in cameras:
        pixels = camera.pixel_centres()
        directions_out = camera.directions(pixels[:: max(len(pixels) * len(cameras) // PIXELS, 1)]).astype(np.float32)
        origins = np.broadcast_to(camera.centre.astype(np.float32), directions_out.shape)
        cell = exits(low, size, origins, directions_out)[0]
        free = (scene.intersect(origins, directions_out).triangle < 0) & within(low, size, origins)
        free &= sky.at(sky.clipped, directions_out) | (sky(directions_out) @ LUMINANCE > typical)
        rays += np.bincount(cell, minlength=CELLS)
        outward_cells.append(cell[free])
        directions.append(directions_out[free])
    cell = np.concatenate(outward_cells)
    windows = 2 * np.bincount(cell, minlength=CELLS) > rays
    return windows, np.concatenate(directions)[windows[cell]]


def within(low: np.ndarray, size: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points ((n, 3)) inside of a box, (n,) bool."""
    return ((points >= low) & (points <= low + size)).all(1)


def exits(
    low: np.ndarray, size: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where rays from inside the box leave it: flat cell, distance and |cosine| to the side's normal."""
    far_side = low + np.where(directions > 0, size, np.float32(0))
    cosines = np.abs(directions)
    distances = np.where(cosines > 1e-9, np.abs(far_side - origins) / np.maximum(cosines, 1e-9), np.float32(np.inf))
    axis = distances.argmin(1)
    index = np.arange(len(axis))
    distance = distances[index, axis]
    point = (origins + distance[:, None] * directions - low) / size
    first, second = (axis + 1) % 3, (axis + 2) % 3
    row = np.clip((point[index, first] * GATHER.cells).astype(np.int64), 0, GATHER.cells - 1)
    column = np.clip((point[index, second] * GATHER.cells).astype(np.int64), 0, GATHER.cells - 1)
    side = 2 * axis + (directions[index, axis] > 0)
    return (side * GATHER.cells + row) * GATHER.cells + column, distance, cosines[index, axis]


def in_cells(cell: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Points of the box (0...1) at a `place` (0...1, (n, k, 2)) in each of n flat cells, (n, k, 3) float64."""
    side, row, column = np.unravel_index(cell, (6, GATHER.cells, GATHER.cells))
    axis, index = side // 2, np.arange(len(cell))
    share = np.empty((*place.shape[:2], 3))
    share[index, :, axis] = (side % 2)[:, None]
    share[index, :, (axis + 1) % 3] = (row[:, None] + place[..., 0]) / GATHER.cells
    share[index, :, (axis + 2) % 3] = (column[:, None] + place[..., 1]) / GATHER.cells
    return share


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

        Beside what frames saw through a window the map continues, or the window's rim would show the room's own colour.
        """
        directions = sky.directions
        start = np.broadcast_to(np.asarray(place, np.float32), directions.shape)
        incoming = self(start, directions)[0].reshape(sky.radiance.shape)
        unknown = sky.unfamiliar if sky.seen else np.ones(sky.observations.shape, np.float32)
        # What lies behind a window is seen in other directions from other places.
        side = np.unique(np.flatnonzero(self.windows) // GATHER.cells**2)
        outward = directions[:, side // 2] * np.where(side % 2, 1, -1) > 0
        unknown = np.where(outward.any(1).reshape(unknown.shape), np.float32(0), unknown)[..., None]
        bound = np.maximum(incoming, sky.radiance)
        radiance = np.where(sky.clipped[..., None], bound, (1 - unknown) * sky.radiance + unknown * incoming)
        return replace(sky, radiance=radiance.astype(np.float32))

    @property
    def bright(self) -> np.ndarray:
        """Cells that are far brighter than most, (CELLS,) bool."""
        luminance = self.radiance @ LUMINANCE
        return luminance > GATHER.lamp_in_opening * np.median(luminance)

    def without_bright(self) -> Openings:
        """The same, the bright cells like most others."""
        typical = np.median(self.radiance, 0)
        return replace(self, radiance=np.where(self.bright[:, None], typical, self.radiance).astype(np.float32))

    def behind(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """The cells behind n places ((n, 3) float32) of a surface, (n,) int."""
        return exits(self.low, self.size, position, -normal)[0]

    def panels(self, closing: np.ndarray | None = None, sky: Environment | None = None) -> list[Panel]:
        """The bright cells; those that are connected, and about as bright, as one panel.

        Where faces close the mesh before a cell, these emit in its stead: what was solved for came through them alone.

        Parameters
        ----------
        closing : (t, 3, 3) float32, optional
            Corners of the faces that close the mesh and that no frame saw.
        sky : Environment, optional
            What is seen through the cells where nothing closes the mesh; they give the rest, as far as no frame saw it.
        """
        faces = np.zeros((0, 3, 3), np.float32) if closing is None else _subdivided(closing, float(self.size.min()))
        cross = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
        double = np.linalg.norm(cross, axis=1, keepdims=True)
        faces, normal, double = faces[double[:, 0] > 0], cross[double[:, 0] > 0], double[double[:, 0] > 0]
        normal = normal / double
        cell = self.behind(faces.mean(1), normal)
        side_of_cell = np.arange(CELLS) // GATHER.cells**2
        facing = np.abs(normal[np.arange(len(cell)), side_of_cell[cell] // 2])
        closed_area = np.bincount(cell, 0.5 * double[:, 0] * facing, CELLS)
        in_front = faces + np.float32(self.size.max() * PANEL_OFFSET) * normal[:, None]
        corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
        corners = np.where((side_of_cell % 2)[:, None, None], corners[::-1], corners)  # they face the room
        quads = (self.low + in_cells(np.arange(CELLS), corners) * self.size).astype(np.float32)
        area = np.linalg.norm(np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]), axis=1)
        is_open = 2 * closed_area < area
        remaining = self.radiance
        if sky is not None:
            directions = quads.mean(1) - (self.low + self.size / 2)
            directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
            unfamiliar = sky.at(sky.unfamiliar, directions)[:, None] if sky.seen else 1
            remaining = np.maximum(self.radiance - sky(directions), 0) * unfamiliar
        panels = []
        for cells in self._alike():
            on_faces = np.isin(cell, cells)
            if on_faces.any():
                # Of a triangle's corners the last stands twice.
                panels.append(Panel(in_front[on_faces][:, [0, 1, 2, 2]], self.radiance[cells].mean(0)))
            open_cells = cells[is_open[cells]]
            if len(open_cells) and remaining[open_cells].any():
                panels.append(Panel(quads[open_cells], remaining[open_cells].mean(0)))
        return panels

    def _alike(self) -> list[np.ndarray]:
        """Bright cells that lie side by side and are as bright, to the factor that makes one a lamp; flat indices."""
        luminance = self.radiance @ LUMINANCE
        step = np.log(np.maximum(luminance / max(float(np.median(luminance)), 1e-12), 1e-12))
        step = np.floor(step / np.log(GATHER.lamp_in_opening)).astype(int).reshape(6, GATHER.cells, GATHER.cells)
        bright = self.bright.reshape(step.shape)
        groups = []
        for side in range(6):
            for level in np.unique(step[side][bright[side]]):
                label, count = ndimage.label(bright[side] & (step[side] == level))
                groups += [np.flatnonzero(label.ravel() == k) + side * GATHER.cells**2 for k in range(1, count + 1)]
        return groups


def _subdivided(faces: np.ndarray, size: float) -> np.ndarray:
    """Triangles ((t, 3, 3)) in parts no larger than the cells of a box of that size, (s, 3, 3) float32."""
    small = []
    while len(faces):
        large = np.linalg.norm(faces - np.roll(faces, 1, 1), axis=2).max(1) > 2 * size / GATHER.cells
        small.append(faces[~large])
        a, b, c = faces[large].transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = np.concatenate([np.stack(part, 1) for part in parts])
    return np.concatenate([*small, np.zeros((0, 3, 3))]).astype(np.float32)
