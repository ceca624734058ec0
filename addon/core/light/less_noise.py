"""Take the rays' noise out of light over the surface, and leave its edges: Lee's filter with a known noise.

In a cell of the surface light is a plane over the position plus a residual of variance v; the rays' noise has n^2.
What is kept of an element's residual is max(v - n^2, 0) / v (Lee 1980): where light is smooth the residual is noise and
goes, at the edge of a shadow it is light and stays. Cells on several shifted grids are averaged, so that none shows.
"""

from collections.abc import Iterator

import numpy as np

from ..kinds import Block
from ..parallel import ordered_map
from ..significance import LEVELS
from .params import LESS_NOISE

AT_ONCE: Block[int] = 1 << 17
"""Elements, or few cells' more."""


def less_noise(
    position: np.ndarray, normal: np.ndarray, light: np.ndarray, noise: np.ndarray, threads: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Light with less noise, and how noisy it was around each place.

    Over seeds a third of the noise is left (a kitchen with seven small lamps: .030 of E, from .081). Where rays
    disagree, though, lamps are near or hidden in part, and E is off for reasons that all rays share: mesh, texel, the
    lamp's own evenness. So the error of E goes by what there was (kitchen: albedo of 25.7 dB, 24.0 by what is left; in
    four other rooms -.2 to +.1 dB, after one scale -.3 to +.5).

    Parameters
    ----------
    position, normal : (m, 3) float32
    light : (m, 3) float32
        Any unit.
    noise : (m,) float32
        Standard error of the mean of its channels; its mean square over a cell is what counts.

    Returns
    -------
    light : (m, 3) float32
    noise : (m,) float32
        Root mean square over the cells around.
    """

    result, noise_square = np.zeros_like(light), np.zeros(len(light))

    def filter_cells(portion: tuple[np.ndarray, np.ndarray]) -> None:
        """Add the filtered light of some cells, and the mean square of their noise."""
        elements, group = portion
        cell_light, count = light[elements], np.bincount(group)
        fitted = _planes(position[elements], cell_light, group, count)
        residual = (cell_light - fitted).mean(1)
        n2, v = (np.bincount(group, x.astype(np.float64) ** 2) / count for x in (noise[elements], residual))
        kept_share = np.where(count >= LEVELS.few, np.maximum(v - n2, 0) / np.maximum(v, 1e-30), 1)
        result[elements] += fitted + kept_share[group, None].astype(np.float32) * (cell_light - fitted)
        noise_square[elements] += n2[group]

    for k in range(LESS_NOISE.grids):
        for _ in ordered_map(filter_cells, cells(position, normal, k / LESS_NOISE.grids), threads):
            pass
    return (result / np.float32(LESS_NOISE.grids)), np.sqrt(noise_square / LESS_NOISE.grids).astype(np.float32)


def cells(
    position: np.ndarray, normal: np.ndarray, shift: float, scale: float = 1.0
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Elements by cells of position and of the direction that they face, some whole cells at once.

    Parameters
    ----------
    position, normal : (m, 3) float32
    shift : float
        Of the grid, in cells.
    scale : float
        How many times as wide the cells are.

    Yields
    ------
    elements : (k,) int
        In each cell rising.
    group : (k,) int
        The cell of each, from 0 on.
    """
    key = np.zeros(len(position), np.int64)

    def append_to_key(digit: np.ndarray) -> None:
        nonlocal key
        digit = digit.astype(np.int64)
        digit -= digit.min(initial=0)
        key *= int(digit.max(initial=0)) + 1
        key += digit

    # One axis after the other: all six at once were the most memory that a large room took.
    for coordinate in position.T:
        append_to_key(np.floor(coordinate / (scale * LESS_NOISE.cell) + shift))
    for facing in normal.T:
        append_to_key(np.round(facing * LESS_NOISE.turned / 2) + LESS_NOISE.turned)
    order = np.argsort(key, kind="stable")
    key = key[order]
    new = np.append([True], key[1:] != key[:-1])[: len(key)]
    starts = np.append(np.flatnonzero(new), len(key))
    cuts = np.unique(starts[np.searchsorted(starts, range(0, len(key) + AT_ONCE, AT_ONCE)).clip(max=len(starts) - 1)])
    for first, last in zip(cuts, cuts[1:]):
        yield order[first:last], np.cumsum(new[first:last]) - 1


def _planes(position: np.ndarray, light: np.ndarray, group: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Least squares of light over the position, cell by cell: its values at the elements, (m, 3) float32."""
    cells = len(count)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(group, values, cells) / count

    x = [(coordinate - mean(coordinate)[group]) / LESS_NOISE.cell for coordinate in position.T]
    second, moments = np.empty((cells, 3, 3)), np.empty((cells, 3, 3))
    for i in range(3):
        for j in range(3):
            second[:, i, j] = mean(x[i] * x[j]) if j >= i else second[:, j, i]
            moments[:, i, j] = mean(x[i] * light[:, j])
    # Across a wall there is no slope to find.
    slope = _solved(second + 1e-4 * np.eye(3), moments)
    fitted = np.empty_like(light)
    for c in range(3):
        fitted[:, c] = mean(light[:, c])[group] + sum(x[i] * slope[group, i, c] for i in range(3))
    return fitted


def _solved(symmetric: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions of k systems of three equations, (k, 3, 3); LAPACK takes ten times as long over systems so small."""
    rows = symmetric.transpose(1, 0, 2)
    cofactors = np.stack([np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])], 1)
    determinant = np.einsum("kj,kj->k", rows[0], cofactors[:, 0])
    return (cofactors @ right) / determinant[:, None, None]
