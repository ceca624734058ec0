"""Model selection: Lambertian, a dielectric lobe over diffuse, or metal; the simplest that the data support."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import wilcoxon

from ...brdf.dielectric import DIELECTRIC, MAX_F0
from ...brdf.lambertian import LAMBERTIAN
from ...brdf.metal import METAL
from ...brdf.model import Brdf
from ...brdf.transparent import TRANSPARENT
from ...fit.lobe_fit import LobeFit, element_costs, fit_lobe, held_out_costs, huber, solve
from ...fit.problem import DenseProblem, Problem
from ...fit.transmission import SeeThrough
from ...light.lobes import nearest
from ...significance import LEVELS
from .one_colour import OneColour
from .params import CHOICE, FIT


@dataclass(frozen=True)
class Choice:
    """The model taken for one object.

    Attributes
    ----------
    fit : LobeFit or None
        The best lobe, also where it was not taken; None if there was too little to fit.
    gain : float
        Share of the cost that the lobe takes away on held-out elements.
    sigmas : float
        The same in standard errors.
    scores : dict of str to float
        Cost on held-out elements relative to the Lambertian's, of each model that was tried.
    """

    model: Brdf
    fit: LobeFit | None
    gain: float = 0.0
    sigmas: float = 0.0
    note: str = ""
    scores: dict[str, float] = field(default_factory=dict)
    dielectric: LobeFit | None = None
    """A dielectric's significant lobe that fits nearly as well as the metal's that was taken."""
    metal: LobeFit | None = None
    """A metal's lobe that fits better than any other model, but not significantly."""
    see_through: SeeThrough | None = None
    """How the object shows what is behind it; it is TRANSPARENT then."""
    looks: OneColour | None = None
    """The comparison that makes it metal or coated, where its views alone do not (`by_looks`)."""

    @property
    def lobe(self) -> LobeFit:
        """`fit`, which a model with a lobe has."""
        assert self.fit is not None
        return self.fit


def _gain(with_lobe: np.ndarray, without: np.ndarray, most: float = np.inf) -> tuple[float, float]:
    """Share of the elements' costs that the lobe saves, and the same in standard errors.

    No element counts for saving or costing more than `most`. Nothing where it seems to save more than all: the rays'
    noise that is taken out of a cost is itself told by few of them, and for broad lobes it may come out at many times
    the cost.
    """
    saved = without - with_lobe
    if saved.sum() > max(without.sum(), 0):
        return 0.0, 0.0
    saved = np.clip(saved, -most, most)
    error = saved.std() / np.sqrt(len(saved))
    # Elements seen once cost nothing either way, but for rounding.
    return float(saved.sum() / max(without.sum(), 1e-6 * len(saved))), float(saved.mean() / max(error, 1e-30))


def _gain_of_metal(with_lobe: np.ndarray, without: np.ndarray) -> tuple[float, float]:
    """The same with the z-score of Wilcoxon's signed-rank test where that is the greater.

    A metal differs all over: most of its elements tell, and a few outliers hide that from the mean's. (The highlight of
    a dielectric may lie on few elements, which ranks don't tell.)
    """
    gain, sigmas = _gain(with_lobe, without)
    if np.array_equal(with_lobe, without):
        return gain, sigmas
    ranks = wilcoxon(without - with_lobe, alternative="greater", method="asymptotic")
    return gain, max(sigmas, float(ranks.zstatistic))


def _weighted(dense: DenseProblem, fit: LobeFit) -> tuple[DenseProblem, float]:
    """An object's observations weighted as under its own fit, and the standard deviation of their residual."""
    return dense.expecting(fit.phi, fit.psi, fit.scale), fit.scale


def is_dielectric(fit: LobeFit) -> bool:
    """Whether a dielectric can have this lobe, and it can be distinguished from a diffuse part."""
    return fit.psi[0] <= MAX_F0 and fit.phi <= FIT.broadest_phi


def _is_metallic(fit: LobeFit) -> bool:
    """Whether this lobe is too strong for a dielectric, and can be distinguished from a diffuse part."""
    return float(fit.psi.mean()) > MAX_F0 and fit.phi <= FIT.broadest_phi


def _bare_metal(
    problem: Problem, dense: DenseProblem, phi: float, fit: LobeFit, scale: float
) -> tuple[LobeFit, np.ndarray]:
    """A metal's lobe of width phi with no diffuse part at all: `fit` with its F0, and the elements' costs, (g,)."""
    f0 = metal_f0(problem, phi)
    lobe = dense.lobe(dense.at(phi))
    residual = dense.I - f0.astype(np.float32)[:, None, None, None] * lobe.A - lobe.B
    size = np.sqrt(np.square(residual[:, 0]).mean(0)) / dense.spread
    return replace(fit, phi=float(phi), psi=f0, kappa=0.0), (huber(size, scale) * dense.there).sum(0, dtype=np.float64)


def metal_fit(problem: Problem, dense: DenseProblem) -> LobeFit:
    """The lobe of what is known to be a metal: the one over a diffuse part if it is a metal's, else the lobe alone."""
    metal = fit_lobe(dense, constraints=METAL.constraints)
    if _is_metallic(metal):
        return metal
    widths = dense.grid[dense.grid <= FIT.broadest_phi] if len(dense.grid) > 1 else dense.grid
    dense, scale = _weighted(dense, metal)
    return min(
        (_bare_metal(problem, dense, phi, metal, scale) for phi in widths), key=lambda candidate: candidate[1].sum()
    )[0]


def own_or_class_lobe(own_lobe: LobeFit, class_lobe: LobeFit, model: Brdf, problem: Problem | None) -> LobeFit:
    """An object's own lobe where it explains its frames significantly better than that of its class; else the class's.

    A metal's F0 is its own in either case.
    """
    shared = replace(own_lobe, phi=class_lobe.phi, psi=own_lobe.psi if model.lobe_alone else class_lobe.psi)
    if problem is None:
        return shared
    dense, scale = _weighted(DenseProblem(problem), own_lobe)
    if model.lobe_alone:
        solved = solve(dense, dense.at(shared.phi), own_lobe.kappa, scale, constraints=model.constraints)
        shared = replace(shared, psi=solved.psi[:, 0])
    (with_own, _), (with_shared, _) = (element_costs(dense, fit, scale) for fit in (own_lobe, shared))
    gain, sigmas = _gain(with_own, with_shared)
    return own_lobe if gain > CHOICE.min_gain and sigmas > LEVELS.sigmas else shared


def choose_model(problem: Problem, part: bool = False) -> Choice:
    """The simplest model that the observations support, by two-fold cross-validation over the elements.

    A `part` that is found by shape alone may hold other objects: a rug on the floor, which speaks against its varnish.
    So its lobe need only be likely, however little it gains, and no element says more, either way, than an observation
    that lies `LEVELS.outlier` standard deviations off. It is never called metal, which would take the texture of all.
    """
    if len(np.unique(problem.element)) < LEVELS.few:
        return Choice(LAMBERTIAN, None, note="Too few observations to look for a highlight.")
    dense = DenseProblem(problem)
    odd = (np.random.default_rng(0).permutation(dense.there.shape[1]) % 2).astype(bool)

    def held_out(fit: LobeFit, model: Brdf) -> tuple[np.ndarray, np.ndarray]:
        """Costs of the elements with the lobe fitted to the others, and without one."""
        halves = [held_out_costs(dense, fit, train, scale, model.constraints) for train in (odd, ~odd)]
        with_lobe, without = (np.concatenate(costs) for costs in zip(*halves, strict=True))
        return with_lobe, without

    fit = fit_lobe(dense, constraints=DIELECTRIC.constraints)
    dense, scale = _weighted(dense, fit)
    with_lobe, without = held_out(fit, DIELECTRIC)
    scores = {LAMBERTIAN.name: 1.0, DIELECTRIC.name: float(with_lobe.sum() / max(without.sum(), 1e-30))}
    gain, sigmas = _gain(with_lobe, without, LEVELS.outlier**2 / 2 if part else np.inf)
    large = gain > LEVELS.gain and dense.there.shape[1] >= LEVELS.enough
    enough = sigmas > (LEVELS.likely if large or part else LEVELS.sigmas) and (part or gain > CHOICE.min_gain)
    # At the grid's end a still broader one might do as well.
    identifiable = large and sigmas > LEVELS.sigmas and fit.phi < dense.grid[-1]
    sure = enough and (fit.phi <= FIT.broadest_phi or identifiable)
    # Too strong for a dielectric, but over a diffuse part, so no metal: the light is off.
    dielectric = replace(fit, psi=np.minimum(fit.psi, MAX_F0))
    metal, likely = fit_lobe(dense, constraints=METAL.constraints), None
    if not part and _is_metallic(metal):
        with_metal, diffuse = held_out(metal, METAL)
        scores[METAL.name] = float(with_metal.sum() / max(diffuse.sum(), 1e-30))
        # A broad lobe of a dielectric can look like a weak metal's: it must be distinguished from that, too.
        metal_gain, metal_sigmas = _gain_of_metal(with_metal, diffuse)
        gain_over_dielectric, sigmas_over_dielectric = _gain_of_metal(with_metal, with_lobe)
        # What mirrors much costs more by errors of what it mirrors: the more it takes off a dielectric's cost, the less
        # may this one decide.
        bare_cost = _bare_metal(problem, dense, metal.phi, metal, scale)[1].sum() * (1 - gain_over_dielectric)
        if min(metal_gain, gain_over_dielectric) > CHOICE.min_gain and bare_cost <= CHOICE.bare * diffuse.sum():
            if metal_sigmas > LEVELS.sigmas and sigmas_over_dielectric > LEVELS.likely:
                alternative = dielectric if sure and sigmas_over_dielectric < LEVELS.sigmas else None
                return Choice(METAL, metal, metal_gain, metal_sigmas, scores=scores, dielectric=alternative)
            likely = metal
    if sure:
        return Choice(DIELECTRIC, dielectric, gain, sigmas, scores=scores, metal=likely)
    note = "Roughness and specular are not identifiable from these frames."
    return Choice(LAMBERTIAN, fit, gain, sigmas, note, scores, metal=likely)


def set_apart(choice: Choice, see_through: SeeThrough, sure: bool) -> Choice:
    """An object's choice, TRANSPARENT if it is `sure` that its frames show what is behind it."""
    scores = choice.scores | {TRANSPARENT.name: see_through.score}
    if not sure:
        return replace(choice, scores=scores)
    description = (
        f"cut out, with holes over {see_through.transmission:.0%} of it"
        if see_through.cut_out
        else (f"transparent: {see_through.transmission:.0%} of what is behind it passes")
    )
    note = f"Set apart as {description}. Its own colour is uncertain."
    return Choice(TRANSPARENT, None, see_through.gain, see_through.sigmas, note, scores, see_through=see_through)


def contradicts(problem: Problem, fit: LobeFit, model: Brdf) -> bool:
    """Whether frames speak against a lobe that others have, or against its having nothing beside it, as a metal has."""
    dense, scale = _weighted(DenseProblem(problem), fit)
    with_lobe, diffuse = element_costs(dense, fit, scale)
    if _gain(with_lobe, diffuse)[0] < -LEVELS.gain:
        return True
    if not model.lobe_alone:
        return False
    return not _bare_metal(problem, dense, fit.phi, fit, scale)[1].sum() <= CHOICE.bare * diffuse.sum()


def metal_f0(problem: Problem, phi: float) -> np.ndarray:
    """F0 of a metal, (3,): its reflectance, limited to what metals have."""
    return np.clip(reflectance(problem, phi), 0.02, 1.0)


def reflectance(problem: Problem, phi: float) -> np.ndarray:
    """F0 of what has no diffuse part, (3,): all its light is the lobe's, so I = F0 A + B; the median ratio over the
    observations. Above 1 it reflects more than it receives."""
    at = nearest(problem.light.grid, phi)
    A, B = problem.light.A[:, at].astype(np.float64), problem.light.B[:, at].astype(np.float64)
    strong = A.mean(1) >= np.median(A.mean(1)) * 0.5
    return np.median((problem.radiance[strong] - B[strong]) / np.maximum(A[strong], 1e-9), 0)
