"""Fit of phi and psi: grid search in phi, nested least squares in psi (Haefner et al. 2021, sec. 3.4).

Two ways. 'target': the paper's, one frame, I - L_d against psi A + B. 'frames': several frames at once; what does not
change from view to view, the diffuse part, is taken out of each element by least squares over the views, so that a
median that still holds a broad lobe does not bias the fit. A diffuse part under a glossy coat darkens towards grazing
views, where the coat reflects more; 'frames' lets it: D t(n.wo), t = 1 - kappa (1 - n.wo)^2. Without it a floor's
highlights were half hidden by that darkening (living room: cost 0.90 of the Lambertian's without kappa, 0.78 with).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .lobes import GRID, LobeLight

HUBER = 2.0
"""Residuals beyond this many (robust) standard deviations weigh less: misregistration, edges, texture."""
ROUNDS = 3
KAPPAS = (0.0, 0.15, 0.3, 0.45, 0.6)


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
    cosine : (m,) float32
        n.wo.
    """

    element: np.ndarray
    radiance: np.ndarray
    lit_diffuse: np.ndarray
    light: LobeLight
    cosine: np.ndarray

    def part(self, chosen: np.ndarray) -> Problem:
        """The observations `chosen` ((m,) bool)."""
        light = LobeLight(self.light.A[chosen], self.light.B[chosen], self.light.mirror[chosen])
        return Problem(
            self.element[chosen], self.radiance[chosen], self.lit_diffuse[chosen], light, self.cosine[chosen]
        )


@dataclass(frozen=True)
class LobeFit:
    """Best phi and psi of one object.

    Attributes
    ----------
    phi : float
    psi : (3,) float64
        Equal in all channels unless `coloured`.
    kappa : float
        How much the diffuse part darkens towards grazing views.
    kappa_lambertian : float
        The same with no lobe.
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
    kappa: float
    kappa_lambertian: float
    cost: float
    cost_by_phi: np.ndarray
    cost_lambertian: float
    diffuse_share: float
    signal: float
    residual: float
    residual_lambertian: float


class _Solver:
    """Nested least squares in psi for given phi and kappa."""

    def __init__(self, problem: Problem, free_diffuse: bool, coloured: bool, least_psi: float = 0.0):
        self.free, self.coloured, self.least_psi = free_diffuse, coloured, least_psi
        self.problem = problem
        _, self.group = np.unique(problem.element, return_inverse=True)
        self.groups = int(self.group.max()) + 1
        self.I = problem.radiance.astype(np.float64)
        self.Ld = problem.lit_diffuse.astype(np.float64)
        self.count = np.bincount(self.group, minlength=self.groups)
        # Noise and misregistration grow with radiance: residuals count relative to the element's own level, with a
        # floor at a tenth of the object's.
        level = np.bincount(self.group, self.I.mean(1), self.groups) / self.count
        self.level = np.maximum(level, 0.1 * np.median(level) + 1e-12)[self.group]
        # a mean over n views takes part of the residual with it
        self.inflate = np.sqrt(self.count / np.maximum(self.count - 1, 1))[self.group, None] if free_diffuse else 1.0
        self.t = np.ones(len(self.I))

    def darken(self, kappa: float) -> None:
        """Set how the diffuse part depends on the view."""
        self.t = 1 - kappa * (1 - self.problem.cosine.astype(np.float64)) ** 2

    def diffuse(self, values: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """What each element's own diffuse part takes of `values` ((m, 3)): D t with D by least squares."""
        wt = weight * self.t
        below = np.maximum(np.bincount(self.group, wt * self.t, self.groups), 1e-30)
        D = np.stack([np.bincount(self.group, wt * values[:, c], self.groups) / below for c in range(3)], -1)
        return D[self.group] * self.t[:, None]

    def residual(self, A: np.ndarray, B: np.ndarray, psi: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Size of the relative residual (m,) for given psi."""
        rest = self.I - psi * A - B
        rest = (rest - (self.diffuse(rest, weight) if self.free else self.Ld)) * self.inflate
        return np.sqrt(np.einsum("mc,mc->m", rest, rest) / 3) / self.level

    def psi(self, A: np.ndarray, B: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """clip(<A, r - B> / <A, A>, 0, 1), (3,)."""
        r = self.I - B
        a, r = (A - self.diffuse(A, weight), r - self.diffuse(r, weight)) if self.free else (A, r - self.Ld)
        w = weight / self.level**2
        up, down = np.einsum("m,mc,mc->c", w, a, r), np.einsum("m,mc,mc->c", w, a, a)
        if not self.coloured:
            up, down = np.full(3, up.sum()), np.full(3, down.sum())
        return np.clip(up / np.maximum(down, 1e-30), self.least_psi, 1)

    def lobe(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """A and B, (m, 3) float64, at one phi of the grid."""
        return self.problem.light.A[:, index].astype(np.float64), self.problem.light.B[:, index].astype(np.float64)

    def solve(self, index: int, kappa: float, scale: float) -> tuple[float, np.ndarray, np.ndarray]:
        """Robust cost, psi and weights for one phi and kappa, by iteratively reweighted least squares."""
        self.darken(kappa)
        A, B = self.lobe(index)
        weight = np.ones(len(A))
        for _ in range(ROUNDS):
            psi = self.psi(A, B, weight)
            size = self.residual(A, B, psi, weight)
            weight = np.minimum(1, HUBER * scale / np.maximum(size, 1e-12))
        return float(huber(size, scale).mean()), psi, weight

    def no_lobe(self, kappa: float) -> np.ndarray:
        """Size of the relative residual (m,) of a Lambertian object."""
        self.darken(kappa)
        return self.residual(np.zeros_like(self.I), np.zeros_like(self.I), np.zeros(3), np.ones(len(self.I)))


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
    kappas = KAPPAS if solver.free else (0.0,)
    flat = [solver.no_lobe(kappa) for kappa in kappas]
    scale = robust_scale(flat[0])
    kappa, costs = kappas[len(kappas) // 2], np.full(len(grid), np.inf)
    # phi at a middling kappa, kappa at that phi, phi again; and the scale from the fit, or every outlier of the poor
    # start would count as noise.
    for _ in range(2 if solver.free else 1):
        costs = np.array([solver.solve(i, kappa, scale)[0] for i in range(len(grid))])
        best = int(np.argmin(costs))
        kappa = min(kappas, key=lambda k: solver.solve(best, k, scale)[0])
        _, psi, weight = solver.solve(best, kappa, scale)
        A, B = solver.lobe(best)
        scale = robust_scale(solver.residual(A, B, psi, weight))
    cost, psi, weight = solver.solve(best, kappa, scale)
    lobe = psi * A + B
    mean = max(float(problem.radiance.mean()), 1e-12)
    moved = lobe - solver.diffuse(lobe, weight) if solver.free else lobe
    size = solver.residual(A, B, psi, weight)
    flat_costs = [float(huber(f, scale).mean()) for f in flat]
    flattest = int(np.argmin(flat_costs))
    return LobeFit(
        phi=float(grid[best]),
        psi=psi,
        kappa=kappa,
        kappa_lambertian=kappas[flattest],
        cost=cost * scale**2,
        cost_by_phi=costs * scale**2,
        cost_lambertian=flat_costs[flattest] * scale**2,
        diffuse_share=float(np.clip((problem.radiance - lobe).mean() / mean, 0, 1)),
        signal=float(np.sqrt((moved**2).mean()) / mean),
        residual=float(np.median(size)),
        residual_lambertian=float(np.median(flat[flattest])),
    )


def element_costs(problem: Problem, fit: LobeFit, lobe: bool, scale: float, grid: np.ndarray = GRID) -> np.ndarray:
    """Robust cost of each element's observations under a fit made elsewhere, with its lobe or without: (groups,)."""
    solver = _Solver(problem, True, True)
    if lobe:
        solver.darken(fit.kappa)
        A, B = solver.lobe(int(np.argmin(np.abs(grid - fit.phi))))
        size = solver.residual(A, B, fit.psi, np.ones(len(A)))
    else:
        size = solver.no_lobe(fit.kappa_lambertian)
    return np.bincount(solver.group, huber(size, scale), solver.groups)
