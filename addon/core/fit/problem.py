"""The observations of one object, and their arrangement by views and elements in which the fit runs quickly."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..light.lobes import LobeLight, nearest
from .params import LOBE_FIT


@dataclass(frozen=True)
class Problem:
    """The observations of one object, ready to be fitted.

    Attributes
    ----------
    element : (m,) int
        Group of each observation: those of one surface element.
    radiance : (m, 3) float
        I.
    light : LobeLight
        A and B of each observation.
    cosine : (m,) float32
        n.wo.
    without : frozenset of str
        Passes left out of the fit.
    """

    element: np.ndarray
    radiance: np.ndarray
    light: LobeLight
    cosine: np.ndarray
    without: frozenset[str] = frozenset()

    def part(self, chosen: np.ndarray) -> Problem:
        """The observations `chosen` ((m,) bool)."""
        return Problem(
            self.element[chosen], self.radiance[chosen], self.light.part(chosen),
            self.cosine[chosen], self.without,
        )  # fmt: skip


class Regressors(NamedTuple):
    """A, B and the products of their noise for h phi, (3, h, views, elements) float32 each, relative to the level."""

    A: np.ndarray
    B: np.ndarray
    AA: np.ndarray
    AB: np.ndarray
    BB: np.ndarray


class DenseProblem:
    """A problem as dense arrays: channel, phi, view, element; what an element was not seen in has weight 0.

    Sums over an element's views are then sums over an axis, and every loop runs along hundreds of elements: solving
    for all phi at once takes a fifth of the time that one phi after the other took with `np.bincount`.

    Attributes
    ----------
    I : (3, 1, v, g) float32
        Radiance over the element's own level: noise and misregistration grow with radiance.
    there : (v, g) float32
        1 where there is an observation, else 0.
    spread : (v, g) float32 or None
        Standard deviation of each observation's residual over that of one with no lobe in it; None: as each lobe that
        is tried has it.
    inflate : (g,) float32
        A mean over n views takes part of the residual with it; this makes up for it.
    count : int
        Observations.
    grid : (p,) float32
        phi of the lobes.
    """

    def __init__(self, problem: Problem):
        self.count, self.grid = len(problem.element), problem.light.grid
        self.without = problem.without
        order = np.argsort(problem.element, kind="stable")
        _, start, views = np.unique(problem.element[order], return_index=True, return_counts=True)
        group = np.repeat(np.arange(len(start)), views)
        rank = np.arange(self.count) - start[group]
        shape = (int(views.max()), len(start))
        self._slot = rank * shape[1] + group
        self._order, self._shape = order, shape
        self.there = self.laid(np.ones(self.count, np.float32))
        mean = np.bincount(group, problem.radiance[order].mean(1), shape[1]) / views
        # With a floor at a tenth of the object's level.
        self._level = level = np.maximum(mean, 0.1 * np.median(mean) + 1e-12).astype(np.float32)
        self.inflate = np.sqrt(views / np.maximum(views - 1, 1)).astype(np.float32)
        self.I = self.laid(problem.radiance.T)[:, None] / level
        self.spread: np.ndarray | None = None
        self._grazing = (1 - self.laid(problem.cosine)) ** 2
        light = problem.light
        A, B, dA, dB = (self.laid(x.T) / level for x in (light.A, light.B, light.A_noise, light.B_noise))
        self._lobe = Regressors(A, B, dA * dA, dA * dB, dB * dB)

    @property
    def views(self) -> float:
        """Of an element, on average."""
        return self.count / self.there.shape[1]

    def relative(self, radiance: np.ndarray) -> np.ndarray:
        """A radiance of the observations ((m, 3)), over the elements' own levels, (3, v, g) float32."""
        return self.laid(radiance.T) / self._level

    def laid(self, values: np.ndarray) -> np.ndarray:
        """(..., m) values of the observations as (..., v, g) float32; 0 where there is none."""
        result = np.zeros((*values.shape[:-1], self._shape[0] * self._shape[1]), np.float32)
        result[..., self._slot] = values[..., self._order]
        return result.reshape(*values.shape[:-1], *self._shape)

    def darkening(self, kappa: float | tuple[float, ...]) -> np.ndarray:
        """t of the diffuse part for each kappa, (k, v, g)."""
        kappas = np.atleast_1d(np.asarray(kappa, np.float32))[:, None, None]
        return 1 - kappas * self._grazing

    def at(self, phi: float) -> slice:
        """The phi of the grid next to this one."""
        index = nearest(self.grid, phi)
        return slice(index, index + 1)

    def lobe(self, phi: slice) -> Regressors:
        """A, B and their noise for some phi of the grid."""
        return Regressors(*(values[:, phi] for values in self._lobe))

    def seen(self, values: np.ndarray) -> np.ndarray:
        """Of (v, g) values those of observations, (m,)."""
        return values[self.there > 0]

    def own_spread(self, lobe: Regressors, psi: np.ndarray, scale: float) -> np.ndarray:
        """`spread` under each of several lobes with psi ((3, h)), (h, v, g) float32.

        By what a view shows of the lobe beyond the view that shows least of it: what all of an element's views show
        counts as its diffuse part, be it off or not. `scale` is the standard deviation of the residual with no lobe,
        relative to the element's level.
        """
        visible = (np.asarray(psi, np.float32)[:, :, None, None] * lobe.A + lobe.B).mean(0)
        return _spread(visible - np.where(self.there > 0, visible, np.inf).min(1, keepdims=True), scale)

    def expecting(self, phi: float, psi: np.ndarray, scale: float) -> DenseProblem:
        """The same with one `spread` for all hypotheses, which are compared so: by all that a lobe shows.

        psi is of each channel, (3,), `scale` as in `own_spread`.
        """
        lobe, dense = self.lobe(self.at(phi)), copy.copy(self)
        visible = np.asarray(psi, np.float32)[:, None, None] * lobe.A[:, 0] + lobe.B[:, 0]
        dense.spread = _spread(visible.mean(0), scale)
        return dense

    def part(self, chosen: np.ndarray) -> DenseProblem:
        """The same for some elements, (g,) bool."""
        part = object.__new__(DenseProblem)
        part.grid, part.without = self.grid, self.without
        part.there, part.inflate, part.I = self.there[:, chosen], self.inflate[chosen], self.I[..., chosen]
        part._grazing = self._grazing[:, chosen]
        part.spread = None if self.spread is None else self.spread[:, chosen]
        part.count = int(part.there.sum())
        part._lobe = Regressors(*(values[..., chosen] for values in self._lobe))
        return part


def _spread(visible: np.ndarray, scale: float) -> np.ndarray:
    """Spread of observations that show a lobe's radiance `visible`, known up to a share of itself."""
    return np.sqrt(1 + np.square(np.float32(LOBE_FIT.light_error / scale) * visible))
