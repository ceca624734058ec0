"""The smooth error that E leaves in an object's albedo.

E errs smoothly: around a lamp under a shade, in a corner whose bounce is too weak. Paint changes at once, or finely. So
what changes slowly is taken for E's error (Land and McCann 1971). It is found as the bias field of a magnetic resonance
image is (Wells et al. 1996), by turns: which elements are of the object's main colour under the field, and the field as
those elements' residuals, smoothed.
"""

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from ...groups import by_label
from ...kinds import Unit
from ...parallel import ordered_map
from ...scene.atlas import Atlas
from ...significance import LEVELS
from .params import ALBEDO, BIAS

FACINGS: Unit[int] = 6


def without_bias(atlas: Atlas, rho: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Albedo with each object's bias field taken out, (n, 3) float32; the median of its field stays.

    A sheet's second side has a field of its own.

    Parameters
    ----------
    rho : (n, 3) float32
        Quotient, not clamped; anything where nothing was measured.
    measured : (n,) bool
    """
    result = rho.copy()
    known = np.flatnonzero(measured)
    reach = BIAS.reach * np.sqrt(float(atlas.area[known].sum()))
    parts = [known[elements] for elements in by_label(atlas.side[known]) if len(elements) >= LEVELS.many]

    def corrected(elements: np.ndarray) -> np.ndarray:
        return rho[elements] / np.exp(_field(atlas, elements, rho[elements], reach))

    for elements, cleared in zip(parts, ordered_map(corrected, parts, 0), strict=True):
        result[elements] = cleared
    return result


def _field(atlas: Atlas, elements: np.ndarray, rho: np.ndarray, reach: float) -> np.ndarray:
    """Log of the bias field of one object's m measured elements, (m, 3), around its median."""
    sample = np.random.default_rng(0).permutation(len(elements))[: LEVELS.sample]
    colour = np.log(np.maximum(rho, ALBEDO.floor))
    area = atlas.area[elements][sample].astype(float)
    grid = _Grid(atlas.position[elements], atlas.normal[elements], sample, reach, float(np.sqrt(np.median(area))))
    offset = colour[sample] - _mode(colour[sample], area)
    field = np.zeros_like(offset)
    for _ in range(BIAS.rounds):
        weight = area * _membership(offset - field)
        smooth = grid.smooth(offset, weight)
        field = grid.at(smooth, sample)
    bias = grid.at(smooth) - np.median(field, 0)
    # Taken for an error, a patch of another colour keeps its edge, and slopes come about around it.
    return bias if grid.variation(colour - bias) < grid.variation(colour) else np.zeros_like(bias)


def _membership(offset: np.ndarray) -> np.ndarray:
    """Membership in the main colour, 0...1, (m,), of log colours by their offset from it, (m, 3)."""
    grey = offset.mean(1)
    hue = np.square(offset - grey[:, None]).mean(1)
    return np.exp(-(np.square(grey) + np.square(BIAS.hue) * hue) / (2 * BIAS.tolerance**2))


def _mode(colour: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Mode of log colours, (m, 3), by mean shift from their median, (3,)."""
    mode = np.median(colour, 0)
    for _ in range(BIAS.rounds):
        near = weight * _membership((colour - mode) / 2)
        mode = near @ colour / max(near.sum(), 1e-30)
    return mode


class _Grid:
    """A field over positions and normals: a grid of cells for each side of an ambient cube (McTaggart 2004).

    A normal's squared components are what each side counts there; they sum to 1.
    """

    def __init__(self, position: np.ndarray, normal: np.ndarray, sample: np.ndarray, reach: float, texel: float):
        low, high = position.min(0), position.max(0)
        cell = max(reach / 3, 2 * texel, 1e-9)
        while np.prod((high - low) / cell + 1.5) > BIAS.cells:
            cell *= 1.2
        self.coordinates = (position - low) / cell
        self.shape = tuple(np.floor(self.coordinates.max(0) + 0.5).astype(int) + 1)
        self.sides = np.concatenate([np.square(np.maximum(normal, 0)), np.square(np.minimum(normal, 0))], 1)
        self.sample = sample
        self.sigma = max(reach / cell, 1.0)
        self.cell_of = np.ravel_multi_index(np.floor(self.coordinates + 0.5).astype(int).T, self.shape)
        self.sample_cell = self.cell_of[sample]
        self.facing = self.sides.argmax(1)

    def smooth(self, values: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Weighted Gaussian mean of values ((s, 3)) of `sample`, (sides, 3, *shape), drawn towards 0."""
        summed = np.empty((FACINGS, 4, *self.shape), np.float32)
        for side, counts in zip(summed, self.sides[self.sample].T, strict=True):
            for channel, value in zip(side, (*values.T, 1), strict=True):
                channel[:] = np.bincount(self.sample_cell, weight * counts * value, channel.size).reshape(self.shape)
        around = gaussian_filter(summed, (0, 0, *[self.sigma] * 3), mode="constant", truncate=3)
        return around[:, :3] / (around[:, 3:] + max(BIAS.prior * float(around[:, 3].max()), 1e-30))

    def at(self, field: np.ndarray, elements: np.ndarray | slice = slice(None)) -> np.ndarray:
        """A field's values at the elements, (m, 3)."""
        coordinates, sides = self.coordinates[elements], self.sides[elements]
        result = np.zeros((len(coordinates), 3), np.float32)
        for side in range(FACINGS):
            facing = np.flatnonzero(sides[:, side] > 1e-3)
            for channel in range(3 if len(facing) else 0):
                value = map_coordinates(field[side, channel], coordinates[facing].T, order=1, mode="nearest")
                result[facing, channel] += sides[facing, side] * value
        return result

    def variation(self, colour: np.ndarray) -> float:
        """Total variation of the cells' mean log colour, of (m, 3) of all elements by the side they mostly face."""
        size = int(np.prod(self.shape))
        index = size * self.facing + self.cell_of
        count = np.bincount(index, minlength=FACINGS * size)
        with np.errstate(invalid="ignore"):
            mean = (np.bincount(index, colour.mean(1), FACINGS * size) / count).reshape(FACINGS, *self.shape)
        return float(sum(np.nansum(np.abs(np.diff(mean, axis=axis))) for axis in (1, 2, 3)))
