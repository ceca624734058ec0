"""The radiances of unknown sources, all together, under which albedo is most plausible.

With E = E0 + sum s_k G_k, log albedo a = log(pi L_d / E) is to be alike where the surface is of one plane, which is
robust against edges of paint (Land and McCann's Retinex in three dimensions), and not above what paint reflects; the
brightest surface may be white paint. Colour is told by the light, which is white from outside. All radiances are solved
for together, in log, by L-BFGS.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from ..brdf.lambertian import WHITE_PAINT
from ..scene.params import COPLANAR
from ..significance import LEVELS
from .params import JOINT_FIT


def in_one_plane(position: np.ndarray, normal: np.ndarray, seed: int) -> np.ndarray:
    """Pairs of m elements that lie in one plane, the nearest and some of all, (p, 2) int."""
    m = len(position)
    key = np.concatenate([position, 3 * normal], 1)
    neighbours = cKDTree(key).query(key, min(LEVELS.neighbours + 1, m))[1]
    pairs = [np.stack([np.repeat(np.arange(m), neighbours.shape[1] - 1), neighbours[:, 1:].ravel()], 1)]
    rng = np.random.default_rng(seed)
    drawn = rng.integers(0, m, (8 * LEVELS.neighbours * m, 2))
    a, b = drawn.T
    alike = np.einsum("ij,ij->i", normal[a], normal[b]) > np.cos(COPLANAR.turn)
    distance = np.abs(np.einsum("ij,ij->i", position[a] - position[b], normal[a]))
    pairs.append(drawn[alike & (distance < COPLANAR.off) & (a != b)][: LEVELS.neighbours * m])
    return np.concatenate(pairs)


@dataclass(frozen=True)
class Unknown:
    """k sources seen from m elements.

    Attributes
    ----------
    contribution : (m, k) float64
        E from each at radiance 1.
    by_sun : (m, s, 3) float64
        E by the sun as it was measured, for which a factor is sought; s is 0 where none is.
    lower : (k + s, 3) float64
        Lower bounds of radiances and factor.
    expected : (k + s, 3) float64
        Radiances that the prior expects, and 1. As the sun was measured, its prior has the full weight.
    any_level : (k + s,) bool, or one for all
        Sources of which only the colour is expected: their level was taken from the same L_d, which would count twice.
    known : (k + s, 3) bool, or one for all
        Channels that keep their lower bound.
    """

    contribution: np.ndarray
    by_sun: np.ndarray
    lower: np.ndarray
    expected: np.ndarray
    any_level: np.ndarray | bool = False
    known: np.ndarray | bool = False

    def irradiance(self, radiance: np.ndarray) -> np.ndarray:
        """E from all of them at radiances and a factor ((k + s, 3)), (m, 3) float64."""
        k = self.contribution.shape[1]
        return self.contribution @ radiance[:k] + (self.by_sun * radiance[k:]).sum(1)

    def part(self, which: np.ndarray) -> "Unknown":
        """Some of them alone ((k + s,) bool)."""
        k = self.contribution.shape[1]
        return Unknown(
            self.contribution[:, which[:k]],
            self.by_sun[:, which[k:]],
            self.lower[which],
            self.expected[which],
            np.broadcast_to(self.any_level, which.shape)[which],
            np.broadcast_to(self.known, self.lower.shape)[which],
        )

    def transposed(self, values: np.ndarray) -> np.ndarray:
        """Sums of values ((m, 3)) over the elements as each contributes to them, (k + s, 3) float64."""
        return np.concatenate([self.contribution.T @ values, (self.by_sun * values[:, None]).sum(0)])


class _NegativeLogPosterior:
    """Minus the log posterior, and its gradient, of the log radiances."""

    def __init__(
        self,
        sent: np.ndarray,
        received: np.ndarray,
        unknown: Unknown,
        pairs: np.ndarray,
        area: np.ndarray | None = None,
    ):
        self._sent = np.log(np.maximum(np.pi * sent, 1e-9))
        self._received, self._unknown, self._area = received, unknown, area
        p, m = len(pairs), len(sent)
        ends = np.stack([np.ones(p), -np.ones(p)], 1).ravel()
        self._difference = csr_matrix((ends, pairs.ravel(), 2 * np.arange(p + 1)), (p, m))
        self._difference_transposed = self._difference.T.tocsr()
        self.expected = np.log(np.maximum(unknown.expected, 1e-6))
        k, channels = self.expected.shape
        self.any_level = np.broadcast_to(unknown.any_level, k)
        self._weight = np.full((k, 1), JOINT_FIT.sources * channels / max(k, 1))
        self._weight[unknown.contribution.shape[1] :] = JOINT_FIT.sources * channels

    def log_albedo(self, x: np.ndarray) -> np.ndarray:
        """(m, 3) at log radiances `x` ((k, 3))."""
        return self._sent - np.log(self._received + self._unknown.irradiance(np.exp(x)))

    def __call__(self, flat: np.ndarray) -> tuple[float, np.ndarray]:
        k, (m, channels) = len(self.expected), self._sent.shape
        x = flat.reshape(k, 3)
        radiance = np.exp(x)
        E = self._received + self._unknown.irradiance(radiance)
        a = self._sent - np.log(E)
        difference = self._difference @ a / JOINT_FIT.apart
        value = 0.5 * float(np.log1p(difference**2).sum()) / max(len(difference), 1)
        grad_a = (
            self._difference_transposed
            @ (difference / (1 + difference**2))
            / (JOINT_FIT.apart * max(len(difference), 1))
        )
        # Beside lamps and panes a few elements hold their light: by its square they alone would decide.
        excess = np.maximum(a - np.log(JOINT_FIT.highest), 0) / 0.1
        root = np.sqrt(1 + (excess / LEVELS.sigmas) ** 2)
        value += LEVELS.sigmas**2 * float((root - 1).mean())
        grad_a += excess / root / (0.1 * channels * m)
        if self._area is not None:
            brightest, weight = self._brightest(a)
            offset = (weight @ a[brightest].mean(1) - np.log(WHITE_PAINT)) / JOINT_FIT.deviation
            value += 0.5 * float(offset**2)
            grad_a[brightest] += (offset / (JOINT_FIT.deviation * channels) * weight)[:, None]
        gradient = -self._unknown.transposed(grad_a / E) * radiance
        deviation = x - self.expected
        level = deviation.mean(1, keepdims=True) / JOINT_FIT.unlike
        level[self.any_level] = 0
        tint = (deviation - deviation.mean(1, keepdims=True)) / JOINT_FIT.tint
        coloured = 1 + (tint**2).sum(1, keepdims=True)
        value += float((self._weight * (np.log1p(level**2) + np.log(coloured))).sum())
        gradient += 2 * self._weight * level / (channels * JOINT_FIT.unlike * (1 + level**2))
        gradient += 2 * self._weight * tint / (JOINT_FIT.tint * coloured)
        return value, gradient.ravel()

    def _brightest(self, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Elements of the greatest log albedo but for outliers, (b,) int, and their shares of the area, (b,)."""
        assert self._area is not None
        order = np.argsort(a.mean(1))
        share = np.cumsum(self._area[order]) / self._area.sum()
        low, high = np.searchsorted(share, JOINT_FIT.white)
        brightest = order[low : max(high, low + 1)]
        return brightest, self._area[brightest] / self._area[brightest].sum()


def solve(
    sent: np.ndarray, received: np.ndarray, unknown: Unknown, pairs: np.ndarray, area: np.ndarray | None = None
) -> tuple[np.ndarray, tuple[float, float]]:
    """The most plausible radiances.

    Parameters
    ----------
    sent, received : (m, 3) float64
        L_d, and E from all that is known.
    pairs : (p, 2) int
        Elements that should be alike.
    area : (m,) float, optional
        Of the surface that each stands for, if the brightest of it is likely white paint (Land and McCann 1971).

    Returns
    -------
    radiance : (k, 3) float64
    spread : (2,) tuple of float
        Mean deviation of log albedo between pairs under the expected radiances, and under these.
    """
    cost = _NegativeLogPosterior(sent, received, unknown, pairs, area)
    low = np.log(np.maximum(unknown.lower, 1e-6))
    high = np.where(unknown.known, low, np.maximum(cost.expected, low) + 12)
    start = cost.expected + np.where(cost.any_level, 0, np.log(JOINT_FIT.start))[:, None]
    log_radiance = low  # of a closed mesh without clipped patches nothing is unknown
    if low.size:
        log_radiance = minimize(
            cost, np.clip(start, low, high).ravel(), jac=True, method="L-BFGS-B",
            bounds=np.stack([low, high], -1).reshape(-1, 2),
            options={"maxiter": LEVELS.steps},
        ).x.reshape(low.shape)  # fmt: skip

    def spread(x: np.ndarray) -> float:
        a = cost.log_albedo(x).mean(1)
        return float(np.median(np.abs(a[pairs[:, 0]] - a[pairs[:, 1]])))

    return np.exp(log_radiance), (spread(cost.expected), spread(log_radiance))


def solve_for_some(
    sent: np.ndarray,
    received: np.ndarray,
    unknown: Unknown,
    pairs: np.ndarray,
    believed: Callable[[np.ndarray], np.ndarray],
) -> tuple[np.ndarray, tuple[float, float]]:
    """As `solve`; sources that are not `believed` keep their lower bound, and the others are solved for once more.

    The elements lie evenly over the surface. `believed` gives, of radiances and factor ((k + s, 3)), which sources may
    have them, (k + s,) bool.
    """
    free, radiance = np.ones(len(unknown.lower), bool), unknown.lower.copy()
    while True:
        held = unknown.part(~free)
        under_held = received + held.irradiance(held.lower)
        radiance[free], spread = solve(sent, under_held, unknown.part(free), pairs, np.ones(len(sent)))
        left = free & believed(radiance)
        if (left == free).all():
            return radiance, spread
        free, radiance = left, unknown.lower.copy()
