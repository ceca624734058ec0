"""Fit of phi and psi: grid search in phi, nested least squares in psi (Haefner et al. 2021, sec. 3.4).

Two ways. 'target': the paper's, one frame, I - L_d against psi A + B. 'frames': several frames at once; what does not
change from view to view, the diffuse part, is taken out of each element by its mean over the views, so that a median
that still holds a broad lobe does not bias the fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .lobes import GRID, LobeLight

HUBER = 2.0
"""Residuals beyond this many (robust) standard deviations weigh less: misregistration, edges, texture."""
ROUNDS = 4


@dataclass(frozen=True)
class Problem:
    """The observations of one object, ready to be fitted.

    Attributes
    ----------
    element : (m,) int
        Group of each observation: those of one surface element.
    radiance : (m, 3) float64
        I.
    lit_diffuse : (m, 3) float64
        L_d of the element; what 'target' takes as I_d.
    light : LobeLight
        A and B of each observation.
    """

    element: np.ndarray
    radiance: np.ndarray
    lit_diffuse: np.ndarray
    light: LobeLight


@dataclass(frozen=True)
class LobeFit:
    """Best phi and psi of one object.

    Attributes
    ----------
    phi : float
    psi : (3,) float64
        Equal in all channels unless `coloured`.
    cost : float
        Mean robust cost of the residual, relative to the object's radiance.
    cost_by_phi : (p,) float64
        The same for each phi of the grid.
    cost_lambertian : float
        With no lobe at all.
    diffuse_share : float
        Mean of the diffuse part over mean radiance.
    signal : float
        How much psi's lobe moves the radiance, relative to it.
    residual, residual_lambertian : float
        Median size of the relative residual, with the lobe and without any.
    """

    phi: float
    psi: np.ndarray
    cost: float
    cost_by_phi: np.ndarray
    cost_lambertian: float
    diffuse_share: float
    signal: float
    residual: float
    residual_lambertian: float


def _grouped_mean(values: np.ndarray, weight: np.ndarray, group: np.ndarray, groups: int) -> np.ndarray:
    """Weighted mean of (m, c) values over each group, (groups, c)."""
    total = np.bincount(group, weight, groups)
    return np.stack(
        [np.bincount(group, weight * values[:, c], groups) for c in range(values.shape[1])], -1
    ) / np.maximum(total, 1e-30)[:, None]


class _Solver:
    """Nested least squares in psi for one phi after the other, with shared robust scale."""

    def __init__(self, problem: Problem, free_diffuse: bool, coloured: bool, least_psi: float = 0.0):
        self.free, self.coloured, self.least_psi = free_diffuse, coloured, least_psi
        _, self.group = np.unique(problem.element, return_inverse=True)
        self.groups = int(self.group.max()) + 1
        self.I = problem.radiance.astype(np.float64)  # noqa: E741 - the paper's name
        self.Ld = problem.lit_diffuse.astype(np.float64)
        # Noise and misregistration grow with radiance: residuals count relative to the element's own level, with a
        # floor at a tenth of the object's.
        level = _grouped_mean(self.I.mean(1, keepdims=True), np.ones(len(self.I)), self.group, self.groups)[:, 0]
        self.level = np.maximum(level, 0.1 * np.median(level) + 1e-12)[self.group]
        self.count = np.bincount(self.group, minlength=self.groups)

    def diffuse(self, values: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """What the element's own diffuse part takes of `values`: its mean over the views."""
        return _grouped_mean(values, weight, self.group, self.groups)[self.group]

    def residual(self, A: np.ndarray, B: np.ndarray, psi: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Relative residual (m, 3) for given psi."""
        rest = self.I - psi * A - B
        rest = rest - (self.diffuse(rest, weight) if self.free else self.Ld)
        if self.free:  # a mean over n views takes part of the residual with it
            rest = rest * np.sqrt(self.count / np.maximum(self.count - 1, 1))[self.group, None]
        return rest / self.level[:, None]

    def psi(self, A: np.ndarray, B: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """clip(<A, r - B> / <A, A>, 0, 1), (3,)."""
        r = self.I - B
        if self.free:
            a, r = A - self.diffuse(A, weight), r - self.diffuse(r, weight)
        else:
            a, r = A, r - self.Ld
        w = (weight / self.level**2)[:, None]
        up, down = (w * a * r).sum(0), (w * a * a).sum(0)
        if not self.coloured:
            up, down = np.full(3, up.sum()), np.full(3, down.sum())
        return np.clip(up / np.maximum(down, 1e-30), self.least_psi, 1)

    def solve(self, A: np.ndarray, B: np.ndarray, scale: float) -> tuple[np.ndarray, float, np.ndarray]:
        """psi, robust cost and weights for one phi, by iteratively reweighted least squares."""
        A, B = A.astype(np.float64), B.astype(np.float64)
        weight = np.ones(len(A))
        for _ in range(ROUNDS):
            psi = self.psi(A, B, weight)
            size = np.sqrt((self.residual(A, B, psi, weight) ** 2).mean(1))
            weight = np.minimum(1, HUBER * scale / np.maximum(size, 1e-12))
        return psi, float(huber(size, scale).mean()), weight


def huber(size: np.ndarray, scale: float) -> np.ndarray:
    """Huber cost of residual sizes, in units of scale^2."""
    x = size / scale
    return np.where(x <= HUBER, x * x / 2, HUBER * (x - HUBER / 2))


def robust_scale(size: np.ndarray) -> float:
    """Standard deviation from the median absolute deviation, never 0."""
    return max(1.4826 * float(np.median(size)), 1e-4)


def fit_lobe(
    problem: Problem, way: str = "frames", coloured: bool = False, least_psi: float = 0.0, grid: np.ndarray = GRID
) -> LobeFit:
    """Best phi of the grid, with its psi.

    Parameters
    ----------
    way : str
        'frames' or 'target'.
    coloured : bool
        psi for each channel (a metal's F0); otherwise one for all.
    least_psi : float
        Lower bound of psi.
    """
    solver = _Solver(problem, way == "frames", coloured, least_psi)
    nothing = np.zeros_like(problem.radiance, np.float64)
    ones = np.ones(len(problem.radiance))
    flat = np.sqrt((solver.residual(nothing, nothing, np.zeros(3), ones) ** 2).mean(1))
    scale = previous = robust_scale(flat)
    # The scale comes from the best fit, or every outlier of the poor start would count as noise.
    for _ in range(2):
        found = [solver.solve(problem.light.A[:, i], problem.light.B[:, i], scale) for i in range(len(grid))]
        costs = np.array([cost for _, cost, _ in found])
        best = int(np.argmin(costs))
        psi, _, weight = found[best]
        A, B = (getattr(problem.light, name)[:, best].astype(np.float64) for name in "AB")
        size = np.sqrt((solver.residual(A, B, psi, weight) ** 2).mean(1))
        scale, previous = robust_scale(size), scale
    lobe = psi * A + B
    mean = max(float(problem.radiance.mean()), 1e-12)
    moved = lobe - solver.diffuse(lobe, weight) if solver.free else lobe
    return LobeFit(
        phi=float(grid[best]),
        psi=psi,
        cost=float(costs[best]) * previous**2,
        cost_by_phi=costs * previous**2,
        cost_lambertian=huber(flat, previous).mean() * previous**2,
        diffuse_share=float(np.clip((problem.radiance - lobe).mean() / mean, 0, 1)),
        signal=float(np.sqrt((moved**2).mean()) / mean),
        residual=float(np.sqrt(np.median(size**2))),
        residual_lambertian=float(np.sqrt(np.median(flat**2))),
    )


def element_costs(problem: Problem, fit: LobeFit | None, scale: float, grid: np.ndarray = GRID) -> np.ndarray:
    """Robust cost of each element's observations under a fit made on others (None: Lambertian), (groups,)."""
    solver = _Solver(problem, True, True)
    ones = np.ones(len(problem.radiance))
    if fit is None:
        A = B = np.zeros_like(problem.radiance, np.float64)
        psi = np.zeros(3)
    else:
        at = int(np.argmin(np.abs(grid - fit.phi)))
        A, B = (getattr(problem.light, name)[:, at].astype(np.float64) for name in "AB")
        psi = fit.psi
    size = np.sqrt((solver.residual(A, B, psi, ones) ** 2).mean(1))
    return np.bincount(solver.group, huber(size, scale), solver.groups)
