"""The radiances of unknown sources under which the albedo of a scan without objects is most plausible.

With E = E0 + sum s_k G_k, log albedo a = log(pi L_d / E) is to be alike where the surface is of one plane, which is
robust against edges of paint (Land and McCann's Retinex in three dimensions), to be near a usual albedo, and not above
what paint reflects. Colour is told by the light, which is white from outside. All radiances are solved for together, in
log, by L-BFGS.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from ...brdf.lambertian import USUAL_ALBEDO
from ...scene.params import COPLANAR
from ...significance import LEVELS
from .params import MISSING


def in_one_plane(position: np.ndarray, normal: np.ndarray, seed: int) -> np.ndarray:
    """Pairs of m elements that lie in one plane, the nearest and some of all, (p, 2) int."""
    m = len(position)
    key = np.concatenate([position, 3 * normal], 1)
    near = cKDTree(key).query(key, min(LEVELS.neighbours + 1, m))[1]
    pairs = [np.stack([np.repeat(np.arange(m), near.shape[1] - 1), near[:, 1:].ravel()], 1)]
    rng = np.random.default_rng(seed)
    some = rng.integers(0, m, (8 * LEVELS.neighbours * m, 2))
    a, b = some.T
    alike = np.einsum("ij,ij->i", normal[a], normal[b]) > np.cos(COPLANAR.turn)
    off = np.abs(np.einsum("ij,ij->i", position[a] - position[b], normal[a]))
    pairs.append(some[alike & (off < COPLANAR.off) & (a != b)][: LEVELS.neighbours * m])
    return np.concatenate(pairs)


@dataclass(frozen=True)
class Unknown:
    """k sources seen from m elements.

    Attributes
    ----------
    contribution : (m, k) float64
        E from each at radiance 1.
    least : (k, 3) float64
        Lower bounds of their radiances.
    usual : (k, 3) float64
        What they show if they are no lamps.
    """

    contribution: np.ndarray
    least: np.ndarray
    usual: np.ndarray


class _Plausible:
    """Minus the log posterior, and its gradient, of the log radiances."""

    def __init__(self, sent: np.ndarray, received: np.ndarray, unknown: Unknown, pairs: np.ndarray):
        self._sent = np.log(np.maximum(np.pi * sent, 1e-9))
        self._received, self._G = received, unknown.contribution
        p, m = len(pairs), len(sent)
        ends = np.stack([np.ones(p), -np.ones(p)], 1).ravel()
        self._differ = csr_matrix((ends, pairs.ravel(), 2 * np.arange(p + 1)), (p, m))
        self._back = self._differ.T.tocsr()
        self.usual = np.log(np.maximum(unknown.usual, 1e-6))

    def log_albedo(self, x: np.ndarray) -> np.ndarray:
        """(m, 3) at log radiances `x` ((k, 3))."""
        return self._sent - np.log(self._received + self._G @ np.exp(x))

    def __call__(self, flat: np.ndarray) -> tuple[float, np.ndarray]:
        k, (m, channels) = self._G.shape[1], self._sent.shape
        x = flat.reshape(k, 3)
        radiance = np.exp(x)
        E = self._received + self._G @ radiance
        a = self._sent - np.log(E)
        apart = self._differ @ a / MISSING.apart
        value = 0.5 * float(np.log1p(apart**2).sum()) / max(len(apart), 1)
        by_a = self._back @ (apart / (1 + apart**2)) / (MISSING.apart * max(len(apart), 1))
        off = (a.mean(1) - np.log(USUAL_ALBEDO)) / MISSING.deviation
        value += MISSING.level * 0.5 * float((off**2).mean())
        by_a += (MISSING.level / (MISSING.deviation * channels * m) * off)[:, None]
        # Beside lamps and panes a few elements hold their light: by its square they alone would decide.
        above = np.maximum(a - np.log(MISSING.highest), 0) / 0.1
        far = np.sqrt(1 + (above / LEVELS.sigmas) ** 2)
        value += LEVELS.sigmas**2 * float((far - 1).mean())
        by_a += above / far / (0.1 * channels * m)
        gradient = -(self._G.T @ (by_a / E)) * radiance
        odd = x - self.usual
        level = odd.mean(1, keepdims=True) / MISSING.unlike
        tint = (odd - odd.mean(1, keepdims=True)) / MISSING.tint
        coloured = 1 + (tint**2).sum(1, keepdims=True)
        weight = MISSING.sources * channels / k
        value += weight * float(np.log1p(level**2).sum() + np.log(coloured).sum())
        gradient += (
            weight * 2 * (level / (channels * MISSING.unlike * (1 + level**2)) + tint / (MISSING.tint * coloured))
        )
        return value, gradient.ravel()


def solve(
    sent: np.ndarray, received: np.ndarray, unknown: Unknown, pairs: np.ndarray
) -> tuple[np.ndarray, tuple[float, float]]:
    """The most plausible radiances.

    Parameters
    ----------
    sent, received : (m, 3) float64
        L_d, and E from all that is known.
    pairs : (p, 2) int
        Elements that should be alike.

    Returns
    -------
    radiance : (k, 3) float64
    spread : (2,) tuple of float
        Mean deviation of log albedo between pairs under the least radiances, and now.
    """
    cost = _Plausible(sent, received, unknown, pairs)
    low = np.log(np.maximum(unknown.least, 1e-6))
    start = cost.usual + np.log(MISSING.start)
    found = low  # of a closed mesh without clipped patches nothing is unknown
    if low.size:
        found = minimize(
            cost, np.maximum(start, low).ravel(), jac=True, method="L-BFGS-B",
            bounds=[(one, 12.0) for one in low.ravel()], options={"maxiter": LEVELS.steps},
        ).x.reshape(low.shape)  # fmt: skip

    def spread(x: np.ndarray) -> float:
        a = cost.log_albedo(x).mean(1)
        return float(np.median(np.abs(a[pairs[:, 0]] - a[pairs[:, 1]])))

    return np.exp(found), (spread(cost.usual), spread(found))
