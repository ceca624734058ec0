"""Sampling of the published lobe (`paper.brdf`), and its value for many widths at once.

phi is GGX's alpha (Blender's Roughness is its square root). All arguments are cosines, arrays of one shape.
"""

import numpy as np

from ..kinds import Unit
from ..paper.brdf import G1, D

LEAST: Unit[float] = 1e-4
"""Cosine below which a direction runs along the surface."""


def visible_normal_density(n_wo: np.ndarray, n_h: np.ndarray, phi: float) -> np.ndarray:
    """Solid-angle density of directions that come of sampling the normals visible from wo (Heitz, JCGT 2018).

    Smith's G1(wo) D(h) / (4 n.wo); with this module's `G1` that is G1 D / 2.
    """
    return G1(n_wo, phi) * D(n_h, phi) / 2


def sample_visible_normal(wo: np.ndarray, square: np.ndarray, phi: float) -> np.ndarray:
    """Normals h visible from wo, in the local frame (normal = +Z) (Heitz, JCGT 2018, listing 1).

    Parameters
    ----------
    wo : (3, m) float32
        Unit, z > 0.
    square : (2, m, k) float32
        Random numbers in [0, 1), k for each wo.

    Returns
    -------
    (3, m, k) float32
    """
    stretched = wo * np.array([[phi], [phi], [1]], np.float32)
    stretched = stretched / np.sqrt((stretched * stretched).sum(0))
    x, y, z = stretched
    sine = np.sqrt(x * x + y * y)
    upright = sine < 1e-6
    safe = np.where(upright, 1, sine)
    # t1 and t2 = stretched x t1 span the disc that is sampled; t1 lies level
    t1x, t1y = np.where(upright, 1, -y / safe), np.where(upright, 0, x / safe)
    t2x, t2y, t2z = (c[:, None] for c in (-z * t1y, z * t1x, x * t1y - y * t1x))
    x, y, z, t1x, t1y = (c[:, None] for c in (x, y, z, t1x, t1y))
    radius, angle = np.sqrt(square[0]), np.float32(2 * np.pi) * square[1]
    p1, p2 = radius * np.cos(angle), radius * np.sin(angle)
    chord_square = 1 - p1 * p1
    s = (1 + z) / 2
    p2 = (1 - s) * np.sqrt(chord_square) + s * p2
    up = np.sqrt(np.maximum(chord_square - p2 * p2, 0))
    alpha = np.float32(phi)
    h = np.stack([
        alpha * (p1 * t1x + p2 * t2x + up * x),
        alpha * (p1 * t1y + p2 * t2y + up * y),
        np.maximum(p2 * t2z + up * z, 1e-6),
    ])  # fmt: skip
    h /= np.sqrt(np.einsum("imk,imk->mk", h, h))
    return h


class _GGX:
    """GGX's distribution of normals under Smith's masking, as `model.Microfacets` has it."""

    def lobes(self, n_w: np.ndarray, n_wo: np.ndarray, sin2_h: np.ndarray, grid: np.ndarray) -> np.ndarray:
        """The same as `G` times `D`, but for each phi one division and one root in buffers that stay in the cache.

        45 ns a ray for 16 phi instead of 160 ns.
        """
        m, k = n_w.shape
        result = np.empty((m, len(grid), k), np.float32)
        square, cos2_h, base = n_w * n_w, 1 - sin2_h, np.empty_like(n_w)
        denominator = np.empty_like(n_w)
        for i, phi in enumerate(grid):
            a = np.float32(phi) * np.float32(phi)
            np.multiply(cos2_h, a, out=base)
            base += sin2_h
            base *= base
            np.multiply(square, 1 - a, out=denominator)
            denominator += a
            np.sqrt(denominator, out=denominator)
            denominator += n_w
            denominator *= base
            np.divide(G1(n_wo, phi) * (a / np.float32(np.pi)), denominator, out=result[:, i])
        return result

    def reflect(self, wi: np.ndarray, square: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        wo, w_h, _ = reflected(wi, square, alpha)
        cosine = np.maximum(wo[2], LEAST)
        return wo, w_h, 2 * cosine * G1(cosine, alpha) * (wo[2] > LEAST)


def reflected(wi: np.ndarray, square: np.ndarray, phi: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions wo (3, m) by GGX's visible normals h (3, m), and the cosines w.h (m,): wo, w.h, h.

    Their density is `visible_normal_density` of wi and h, also for distributions that draw none of their own.
    """
    h = sample_visible_normal(wi, square[..., None], phi)[..., 0]
    w_h = np.clip((wi * h).sum(0), 0, 1)
    return 2 * w_h * h - wi, w_h, h


GGX = _GGX()
