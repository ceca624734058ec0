"""Fit of phi and psi to several frames at once: grid search in phi, nested least squares in psi.

The published fit (`paper.fit`) takes one frame and I - L_d. Here what does not change from view to view, the diffuse
part, is taken out of each element by least squares over the views, so that a median that still holds a broad lobe does
not bias the fit. A diffuse part under a glossy coat darkens towards grazing views, where the coat reflects more:
D t(n.wo), t = 1 - kappa (1 - n.wo)^2. Without it a floor's highlights were half hidden by that darkening (living room:
cost 0.90 of the Lambertian's without kappa, 0.78 with).

The regressor A is noisy, as it comes of few rays. Least squares would take that noise for signal: it draws psi to 0,
and makes whatever phi has the noisier A look worse. A and B come from two independent halves of the rays, so that the
noise's part of every product is known (`LobeLight.A_noise`), and is taken out of <A, A>, <A, B> and the cost.
"""

import functools
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..brdf.dielectric import TYPICAL_F0
from ..brdf.model import Constraints
from ..significance import LEVELS, SIGMA_OF_MAD
from .params import LOBE_FIT
from .problem import DenseProblem, Problem

FREE = Constraints()


@dataclass(frozen=True)
class LobeFit:
    """Best phi and psi of one object.

    Attributes
    ----------
    psi : (3,) float64
        Equal in all channels unless the model is coloured.
    kappa : float
        How much the diffuse part darkens towards grazing views.
    kappa_lambertian : float
        The same with no lobe.
    residual, residual_lambertian : float
        Median size of the relative residual, with the lobe and without any.
    """

    phi: float
    psi: np.ndarray
    kappa: float
    kappa_lambertian: float
    residual: float
    residual_lambertian: float

    @property
    def scale(self) -> float:
        """Standard deviation of the relative residual with the lobe, never 0."""
        return robust_scale(np.asarray(self.residual))


@dataclass(frozen=True)
class Solution:
    """Several hypotheses (h of them) solved side by side.

    Attributes
    ----------
    psi : (3, h) float32
    size : (h, views, elements) float32
        Size of the relative residual, over the observation's spread.
    cost : (h, elements) float64
        Robust negative log-likelihood of each element's observations, summed; the rays' noise taken out.
    total : (h,) float64
        Sum of the costs, and what the prior says.
    """

    psi: np.ndarray
    size: np.ndarray
    cost: np.ndarray
    total: np.ndarray


def solve(
    dense: DenseProblem,
    phi: slice | None,
    kappa: float | tuple[float, ...],
    scale: float,
    *,
    psi: np.ndarray | None = None,
    constraints: Constraints = FREE,
) -> Solution:
    """psi, robust cost and residuals for some phi, or one phi and several kappa: iteratively reweighted least squares.

    Parameters
    ----------
    phi : slice or None
        Of the grid; None for no lobe at all.
    psi : (3,) float, optional
        Given: nothing is solved for but the diffuse part.
    constraints : Constraints
        Of psi.
    """
    prior, least_psi = constraints.prior, constraints.least_psi
    t = dense.darkening(kappa)
    prior = None if "dielectric-prior" in dense.without else prior
    if phi is None:
        lobe, R = None, dense.I
    else:
        lobe = dense.lobe(phi)
        R = dense.I - lobe.B
    shape = np.broadcast_shapes(t.shape, R.shape[1:])
    R = np.broadcast_to(R, (3, *shape))
    fixed = None if psi is None else np.asarray(psi, np.float32)[:, None] * np.ones((1, shape[0]), np.float32)

    def spread_with(values: np.ndarray) -> np.ndarray:
        if dense.spread is None and lobe is not None:
            return dense.own_spread(lobe, values, scale)
        return np.broadcast_to(np.float32(1) if dense.spread is None else dense.spread, shape)

    spread = spread_with(np.full((3, 1), TYPICAL_F0) if fixed is None else fixed)
    weight = dense.there / np.square(spread)
    for _ in range(1 if lobe is None or fixed is not None else LOBE_FIT.rounds):
        weighted_t = weight * t
        denominator = np.maximum((weighted_t * t).sum(1), np.float32(1e-20))
        # Of independent noise, once the diffuse part has had its share.
        free_weight = weight * (1 - weighted_t * t / denominator[:, None])
        SR = np.einsum("hvg,chvg->chg", weighted_t, R)
        if lobe is None:
            values, residual = np.zeros((3, shape[0]), np.float32), R - (SR / denominator)[:, :, None] * t
        else:
            A = np.broadcast_to(lobe.A, R.shape)
            SA = np.einsum("hvg,chvg->chg", weighted_t, A)
            if fixed is not None:
                values = fixed
            else:
                wA = weight * A
                numerator = np.einsum("chvg,chvg->ch", wA, R) - np.einsum("chg,chg->ch", SA / denominator, SR)
                square = np.einsum("chvg,chvg->ch", wA, A) - np.einsum("chg,chg->ch", SA / denominator, SA)
                numerator += np.einsum("hvg,chvg->ch", free_weight, np.broadcast_to(lobe.AB, R.shape))
                clean = square - np.einsum("hvg,chvg->ch", free_weight, np.broadcast_to(lobe.AA, R.shape))
                if not constraints.coloured:
                    numerator, square, clean = (np.broadcast_to(x.sum(0), x.shape) for x in (numerator, square, clean))
                if prior is not None:
                    # errors of one element's channels and views go together: they count once
                    counts = 3 * dense.views * (scale / prior.sigma) ** 2
                    numerator, square, clean = numerator + counts * prior.psi, square + counts, clean + counts
                values = np.clip(
                    numerator / np.maximum(np.maximum(clean, LOBE_FIT.least_signal * square), 1e-30), least_psi, 1
                )
            broadcast_psi = values[:, :, None, None]
            residual = R - broadcast_psi * A
            residual -= ((SR - values[..., None] * SA) / denominator)[:, :, None] * t
        spread = spread_with(values)
        size = np.sqrt(np.einsum("chvg,chvg->hvg", residual, residual) / 3) * (dense.inflate / spread)
        weight = dense.there / np.square(spread) * np.minimum(1, LEVELS.outlier * scale / np.maximum(size, 1e-12))
    cost = huber(size, scale)
    if dense.spread is None:  # else the same for all hypotheses
        cost = cost + np.log(spread)
    if lobe is not None:
        noise = (broadcast_psi * (broadcast_psi * lobe.AA + 2 * lobe.AB) + lobe.BB).sum(0)
        cost -= weight * free_weight * np.square(spread * dense.inflate / scale) * noise / 6
    cost *= dense.there
    by_element = cost.sum(1, dtype=np.float64)
    total = by_element.sum(1)
    if prior is not None:
        total += dense.views * ((values[0] - prior.psi) / prior.sigma) ** 2 / 2
    return Solution(values, size, by_element, total)


def huber(size: np.ndarray, scale: float) -> np.ndarray:
    """Huber cost of residual sizes, in units of scale^2."""
    x = size / scale
    return np.where(x <= LEVELS.outlier, x * x / 2, LEVELS.outlier * (x - LEVELS.outlier / 2))


def robust_scale(size: np.ndarray) -> float:
    """Standard deviation from the median absolute deviation, never 0."""
    return max(SIGMA_OF_MAD * float(np.median(size)), 1e-4)


def fit_lobe(
    problem: Problem | DenseProblem, constraints: Constraints = FREE, psi: np.ndarray | None = None
) -> LobeFit:
    """Best phi, with its psi.

    Parameters
    ----------
    problem : Problem, or its DenseProblem where several fits are made
        One with a `spread` keeps it, so that costs can be compared with those of the lobe that it is of.
    constraints : Constraints
        Of psi, as the model has them.
    psi : (3,) float, optional
        Given: phi alone is sought.
    """
    dense = problem if isinstance(problem, DenseProblem) else DenseProblem(problem)
    solve_lobe = functools.partial(solve, constraints=constraints, psi=psi)
    kappas = LOBE_FIT.kappas if "grazing" not in dense.without else (0.0,)
    scale = robust_scale(dense.seen(solve(dense, None, kappas[:1], 1.0).size[0]))

    def step(dense: DenseProblem, kappa: float, scale: float) -> tuple[int, np.ndarray, float, float]:
        """phi at a kappa, kappa at that phi: index of phi, its psi, kappa, and the scale of what is left."""
        best = int(np.argmin(solve_lobe(dense, slice(None), kappa, scale).total))
        by_kappa = solve_lobe(dense, slice(best, best + 1), kappas, scale)
        index = int(np.argmin(by_kappa.total))
        return best, by_kappa.psi[:, index], kappas[index], robust_scale(dense.seen(by_kappa.size[index]))

    # From a middling kappa, then from the one found, and with the scale of the fit, or every outlier of the poor start
    # would count as noise. Once more under the spread of what is reflected, where near widths compare more calmly.
    _, _, kappa, scale = step(dense, kappas[len(kappas) // 2], scale)
    best, lobe_psi, kappa, scale = step(dense, kappa, scale)
    if dense.spread is None:
        dense = dense.expecting(float(dense.grid[best]), lobe_psi, scale)
        best, _, kappa, scale = step(dense, kappa, scale)
    near = slice(max(best - 1, 0), best + 2)
    solution = solve_lobe(dense, near, kappa, scale)
    middle = best - near.start
    root, best_psi = between(np.sqrt(dense.grid[near]), solution.total, solution.psi, middle)
    lambertian = solve(dense, None, kappas, 1.0).size
    lambertian_kappa = int(np.argmin((huber(lambertian, scale) * dense.there).sum((1, 2))))
    return LobeFit(
        phi=float(min(max(root**2, dense.grid[0]), dense.grid[-1])),
        psi=best_psi,
        kappa=kappa,
        kappa_lambertian=kappas[lambertian_kappa],
        residual=float(np.median(dense.seen(solution.size[middle]))),
        residual_lambertian=float(np.median(dense.seen(lambertian[lambertian_kappa]))),
    )


def refitted(dense: DenseProblem, fit: LobeFit, constraints: Constraints, parts: Iterable[np.ndarray]) -> np.ndarray:
    """sqrt(phi) and the mean psi by some elements of a problem each ((g,) bool), (p, 2) float64.

    With kappa, the scale of the residuals and the spread of `fit`, which is that of all elements.
    """
    dense = dense if dense.spread is not None else dense.expecting(fit.phi, fit.psi, fit.scale)
    estimates = []
    for part in parts:
        solution = solve(dense.part(part), slice(None), fit.kappa, fit.scale, constraints=constraints)
        best = int(np.argmin(solution.total))
        near = slice(max(best - 1, 0), best + 2)
        root, psi = between(np.sqrt(dense.grid[near]), solution.total[near], solution.psi[:, near], best - near.start)
        estimates.append((root, psi.mean()))
    return np.array(estimates)


def between(x: np.ndarray, cost: np.ndarray, psi: np.ndarray, middle: int) -> tuple[float, np.ndarray]:
    """Where the parabola through three costs is least, and psi there.

    Parameters
    ----------
    x : (2 or 3,) float
        sqrt(phi), close to evenly spaced in the grid.
    cost : like x
        Least at `middle`.
    psi : (3, 2 or 3) float

    Returns
    -------
    x : float
        No further off than half way to the next.
    psi : (3,) float64
        Interpolated.
    """
    x, psi = x.astype(np.float64), psi.astype(np.float64)
    if len(x) < 3 or middle != 1:
        return float(x[middle]), psi[:, middle]
    left, right = (cost[0] - cost[1]) / (x[0] - x[1]), (cost[2] - cost[1]) / (x[2] - x[1])
    curve = (right - left) / (x[2] - x[0])
    if curve <= 0:
        return float(x[1]), psi[:, 1]
    slope = (right * (x[1] - x[0]) + left * (x[2] - x[1])) / (x[2] - x[0])
    minimum = float(np.clip(x[1] - slope / (2 * curve), (x[0] + x[1]) / 2, (x[1] + x[2]) / 2))
    return minimum, np.array([np.interp(minimum, x, channel) for channel in psi])


def held_out_costs(
    dense: DenseProblem, fit: LobeFit, train: np.ndarray, scale: float, constraints: Constraints
) -> tuple[np.ndarray, np.ndarray]:
    """Costs of the elements that `train` ((g,) bool) leaves, with and without a lobe whose psi the others gave.

    phi and kappa are those of the fit over all: two numbers of hundreds of elements, whose optimism is far below
    what a lobe must gain.
    """
    psi = solve(dense.part(train), dense.at(fit.phi), fit.kappa, scale, constraints=constraints).psi[:, 0]
    return element_costs(dense.part(~train), replace(fit, psi=psi), scale)


def element_costs(dense: DenseProblem, fit: LobeFit, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Robust cost of each element's observations under a fit made elsewhere, with its lobe and without: (g,) each."""
    lobe = solve(dense, dense.at(fit.phi), fit.kappa, scale, psi=fit.psi).cost[0]
    return lobe, solve(dense, None, fit.kappa_lambertian, scale).cost[0]
