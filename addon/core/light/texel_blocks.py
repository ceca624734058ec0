"""A quantity over the surface from few texels: evaluated at the corners of texel blocks, bilinear inside them.

Blocks are halved where their corners differ. A block serves only texels that lie where its corners say, with the same
normal, so neither a chart's border nor a fold of the surface is interpolated across. Unlike a search for the nearest
points, a texel costs a few array look-ups: fine texels cost little more than coarse ones.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from ..kinds import Block
from ..parallel import blocks, ordered_map
from ..scene.atlas import Atlas
from .params import GATHER

BENT = np.cos(np.radians(15.0))
"""A texel turned further than this against a corner of its block is not served by it."""
BLOCK: Block[int] = 1 << 16


class TexelBlocks:
    """Blocks over some of the atlas's elements, (m,) int; results are in their order."""

    def __init__(self, atlas: Atlas, element: np.ndarray, threads: int = 0):
        self._size, self._threads = atlas.size, threads
        self._row, self._column = np.divmod(atlas.texel[element], np.int32(atlas.size))
        self._atlas, self._element = atlas, element
        self._at = np.full(atlas.size * atlas.size, -1, np.int32)
        self._at[atlas.texel[element]] = np.arange(len(element), dtype=np.int32)

    def _served(self, index: np.ndarray, step: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which of `index` blocks of `step` texels serve, with the blocks' corners ((k, 4)) and weights ((k, 4))."""
        row, column = self._row[index], self._column[index]
        low, left = row // step * step, column // step * step
        fits = np.flatnonzero((low + step < self._size) & (left + step < self._size))
        index, low, left, row, column = index[fits], low[fits], left[fits], row[fits], column[fits]
        first = low * self._size + left
        corner = np.stack([self._at[first + a * self._size + b] for a in (0, step) for b in (0, step)], 1)
        complete = np.flatnonzero((corner >= 0).all(1))
        index, corner = index[complete], corner[complete]
        v = ((row - low)[complete] / np.float32(step)).astype(np.float32)
        u = ((column - left)[complete] / np.float32(step)).astype(np.float32)
        weight = np.stack([(1 - v) * (1 - u), (1 - v) * u, v * (1 - u), v * u], 1)
        normal, position, element = self._atlas.normal, self._atlas.position, self._element
        coplanar = np.einsum("kcj,kj->kc", normal[element[corner]], normal[element[index]]).min(1) >= BENT
        index, corner, weight = index[coplanar], corner[coplanar], weight[coplanar]
        corners = position[element[corner]]
        diagonal = corners[:, 3] - corners[:, 0]
        edge = np.sqrt(np.einsum("kj,kj->k", diagonal, diagonal) / 2)
        offset = np.einsum("kc,kcj->kj", weight, corners) - position[element[index]]
        on_surface = (np.einsum("kj,kj->k", offset, offset) <= (GATHER.off_place * edge) ** 2) & (
            edge <= GATHER.stretch * step * self._atlas.texel_edge
        )
        return index[on_surface], corner[on_surface], weight[on_surface]

    def evaluate(
        self, function: Callable[[np.ndarray], np.ndarray], step: int, tolerance: float, base: np.ndarray | None = None
    ) -> np.ndarray:
        """Evaluate a quantity where it changes and interpolate it elsewhere.

        Parameters
        ----------
        function : callable
            Takes indices ((k,) int, into the elements wanted), gives values ((k, c) float32). Each index comes once.
        step : int
            Edge of the largest blocks in texels, a power of two; below 2 everything is evaluated.
        tolerance : float
            Largest deviation of a corner from the corners' mean, relative to that and `base`, at which a block
            serves; by the mean of the first three channels.
        base : (m,) float32, optional
            What is added to the quantity afterwards: deviations count relative to the sum.

        Returns
        -------
        (m, c) float32
        """
        count = len(self._row)
        base = np.zeros(count, np.float32) if base is None else base
        value, known = np.zeros((count, 3), np.float32), np.zeros(count, bool)
        done, remaining = known.copy(), np.arange(count, dtype=np.int32)

        def learn(index: np.ndarray) -> None:
            nonlocal value
            values = function(index)
            if not known.any():
                value = np.zeros((count, values.shape[1]), np.float32)
            value[index], known[index], done[index] = values, True, True

        def spread(block: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
            index, corner, weight = block
            near = value[corner]
            level = near[..., :3].mean(2)
            mean = level.mean(1)
            deviation = np.abs(level - mean[:, None]).max(1)
            flat = np.full(len(index), True) if np.isinf(tolerance) else deviation <= tolerance * (mean + base[index])
            # Corners are known themselves; writing their own value again changes nothing.
            value[index[flat]] = np.einsum("kc,kcv->kv", weight[flat], near[flat])
            done[index[flat]] = True

        while len(remaining) and step >= 2:
            parts = (remaining[part] for part in blocks(len(remaining), BLOCK))
            served = list(ordered_map(partial(self._served, step=step), parts, self._threads))
            wanted = np.zeros(count, bool)
            for _, corner, _ in served:
                wanted[corner] = True
            if (wanted & ~known).any():
                learn(np.flatnonzero(wanted & ~known))
            for _ in ordered_map(spread, served, self._threads):
                pass
            remaining = remaining[~done[remaining]]
            step //= 2
        if len(remaining):
            learn(remaining.astype(np.int64))
        return value
