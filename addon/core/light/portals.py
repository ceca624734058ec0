"""Portals: the openings that light from outside comes in by, as cells on the room's bounding box to aim rays at.

A window fills a small part of the hemisphere; cosine-distributed rays find it by chance. Where rays that left the mesh
crossed the bounding box shows where the openings are, without any knowledge of what a window is.
"""

from dataclasses import dataclass

import numpy as np

from ..luminance import LUMINANCE
from ..scene.tangent_frame import to_world
from ..significance import LEVELS
from .directions import cosine_hemisphere, shifted, sobol
from .field import LightField
from .openings import CELLS, exits, in_cells, within
from .params import GATHER


@dataclass(frozen=True)
class Portals:
    """Cells of the box's sides, with the chance of being aimed at.

    Attributes
    ----------
    low, size : (3,) float32
        The box, metres.
    cell : (k,) int
        Flat indices of the cells with a chance above 0: side (2 * axis, + 1 for the high one), row, column.
    chance : (k,) float64
        Sums to 1; in proportion to the light that came in by the cell to the room's surface.
    density : (6 * CELLS * CELLS,) float32
        Chance over area of every cell: points per square metre.
    """

    low: np.ndarray
    size: np.ndarray
    cell: np.ndarray
    chance: np.ndarray
    density: np.ndarray

    def __len__(self) -> int:
        return len(self.cell)

    def aimed_density(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Solid-angle density with which aimed rays take directions that leave the room, (n,) float32."""
        cell, distance, cosine = exits(self.low, self.size, origins, directions)
        density = self.density[cell] * distance**2 / np.maximum(cosine, 1e-6)
        return np.where(self.around(origins), density, 0)

    def around(self, origins: np.ndarray) -> np.ndarray:
        """Points ((n, 3) float32) inside of the box, (n,) bool: from others nothing is aimed at the portals."""
        return within(self.low, self.size, origins)

    def sample(
        self, origins: np.ndarray, square: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Aim at the cells from n points, k rays each.

        Parameters
        ----------
        origins : (n, 3) float32
            Inside the box.
        square : (n, k, 2) float32
            Where in its cell each ray goes; the cells are stratified over the k.

        Returns
        -------
        directions : (n * k, 3) float32
            Unit.
        density : (n * k,) float32
            By solid angle.
        """
        n, k, _ = square.shape
        strata = (np.arange(k, dtype=np.float32) + rng.random((n, k), np.float32)) / np.float32(k)
        pick = self.cell[np.minimum(np.searchsorted(np.cumsum(self.chance), strata.ravel()), len(self) - 1)]
        point = in_cells(pick, square.reshape(-1, 1, 2))[:, 0].astype(np.float32)
        offset = self.low + point * self.size - np.repeat(origins, k, 0)
        distance = np.sqrt(np.einsum("ij,ij->i", offset, offset))
        directions = offset / np.maximum(distance, 1e-12)[:, None]
        cosine = np.abs(directions[np.arange(len(pick)), pick // (2 * GATHER.cells**2)])
        return directions, self.density[pick] * distance**2 / np.maximum(cosine, 1e-6)


def find_portals(field: LightField, seed: int = 0) -> Portals | None:
    """The openings that matter, from a few rays of points spread over the surface; None where there are none.

    Which cells are found changes the noise of what is computed with them, not its expectation: light through a cell
    that was missed is still gathered.
    """
    if not field.environment.radiance.any() and field.openings is None:
        return None
    if seed not in field.leaving:
        field.leaving[seed] = _leaving(field, seed)
    origins, directions = field.leaving[seed]
    light = field.outside(origins, directions) @ LUMINANCE
    low, size = field.outer_box
    bright = np.flatnonzero((light > 0) & within(low, size, origins))
    if len(bright) < LEVELS.few:
        return None
    light = light[bright]
    cell, _, _ = exits(low, size, origins[bright], directions[bright])
    chance = np.bincount(cell, light.astype(np.float64), CELLS)
    side = np.repeat(np.arange(3), 2 * GATHER.cells**2)
    area = (size[(side + 1) % 3] * size[(side + 2) % 3] / GATHER.cells**2).astype(np.float32)
    cells = np.flatnonzero(chance > 0)
    chance = chance / chance.sum()
    return Portals(low, size, cells, chance[cells], (chance / area).astype(np.float32))


def _leaving(field: LightField, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions of a few rays, from points spread over the surface, that leave the mesh, (k, 3) each."""
    atlas = field.atlas
    rng = np.random.default_rng(seed)
    weight = np.cumsum(atlas.weight.astype(np.float64))
    start = np.searchsorted(weight, (np.arange(LEVELS.sample) + rng.random(LEVELS.sample)) / LEVELS.sample * weight[-1])
    start = np.minimum(start, len(atlas) - 1)
    normal = atlas.normal[start]
    local = cosine_hemisphere(shifted(sobol(GATHER.pilot_rays, seed), LEVELS.sample, rng))
    directions = to_world(local, normal).reshape(-1, 3)
    origins = np.repeat(field.scene.off_surface(atlas.position[start], normal), GATHER.pilot_rays, 0)
    out = np.flatnonzero(field.scene.intersect(origins, directions).triangle < 0)
    return origins[out], directions[out]
