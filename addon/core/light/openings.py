"""Where rays leave the room: cells on its bounding box, and the light that is known to come in by each of them.

A lamp that hangs in a hole of a scan, or a wall that was never scanned, is near: from different places it lies in
different directions, so an environment map can't hold it. A cell of the box can.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from ..kinds import Unit
from ..luminance import LUMINANCE
from .environment import Environment
from .params import GATHER

CELLS = 6 * GATHER.cells**2
"""Of all six sides: side (2 * axis, + 1 for the high one), row, column."""

NOWHERE = np.zeros((0, 3), np.float32)
BEFORE: Unit[float] = 1e-3
"""Sizes of the box that a panel lies before a surface."""


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
        Of its quads; they face the room.
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
    """

    low: np.ndarray
    size: np.ndarray
    radiance: np.ndarray
    share: float = 0.0

    def __call__(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radiance along rays that leave the mesh ((n, 3) float32), and which of them start inside of the box."""
        return self.radiance[exits(self.low, self.size, origins, directions)[0]], within(self.low, self.size, origins)

    def filled(self, sky: Environment, place: np.ndarray) -> Environment:
        """A map with these where it has no value, as a `place` ((3,)) sees them: for what knows maps alone."""
        directions = sky.directions
        start = np.broadcast_to(np.asarray(place, np.float32), directions.shape)
        shown = self(start, directions)[0].reshape(sky.radiance.shape)
        unknown = (sky.observations == 0) | sky.clipped
        return replace(
            sky,
            radiance=np.where(
                unknown[..., None], np.maximum(shown, sky.radiance * sky.clipped[..., None]), sky.radiance
            ),
        )

    @property
    def bright(self) -> np.ndarray:
        """Cells that are far brighter than most, (CELLS,) bool."""
        luminance = self.radiance @ LUMINANCE
        return luminance > GATHER.lamp_in_opening * np.median(luminance)

    def without_bright(self) -> Openings:
        """The same, the bright cells like most others."""
        usual = np.median(self.radiance, 0)
        return replace(self, radiance=np.where(self.bright[:, None], usual, self.radiance).astype(np.float32))

    def behind(self, position: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cells behind n places ((n, 3) float32) of a surface, (n,) int, and how far away they are, metres."""
        cell, distance, _ = exits(self.low, self.size, position, -normal)
        return cell, distance

    def panels(self, position: np.ndarray = NOWHERE, normal: np.ndarray = NOWHERE) -> list[Panel]:
        """The bright cells, those that hang together as one.

        They lie before what closes the mesh there: n places ((n, 3) float32 each) of it.
        """
        found = []
        cell, distance = self.behind(position, normal)
        inset = np.zeros(6)
        np.maximum.at(inset, cell // GATHER.cells**2, distance + float(self.size.max()) * BEFORE)
        bright = self.bright.reshape(6, GATHER.cells, GATHER.cells)
        for side in range(6):
            label, count = ndimage.label(bright[side])
            for one in range(1, count + 1):
                row, column = np.nonzero(label == one)
                radiance = self.radiance[(side * GATHER.cells + row) * GATHER.cells + column].mean(0)
                inward = np.eye(3, dtype=np.float32)[side // 2] * (-1) ** (side % 2)
                quads = self._quads(side, row, column) + np.float32(inset[side]) * inward
                found.append(Panel(quads, radiance))
        return found

    def _quads(self, side: int, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Corners of some cells of a side, (q, 4, 3) float32."""
        axis = side // 2
        around = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
        if side % 2:
            around = around[::-1]
        share = np.empty((len(row), 4, 3))
        share[..., axis] = side % 2
        share[..., (axis + 1) % 3] = (row[:, None] + around[:, 0]) / GATHER.cells
        share[..., (axis + 2) % 3] = (column[:, None] + around[:, 1]) / GATHER.cells
        return (self.low + share * self.size).astype(np.float32)
