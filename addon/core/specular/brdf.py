"""The seed's microfacet model, f_nd = G D F (Haefner et al. 2021, eq. 6 to 9).

phi is GGX's alpha (Blender's Roughness is its square root), psi the reflectance at normal incidence. All arguments are
cosines, arrays of one shape. Reflected radiance is linear in psi:

    I_nd(phi, psi) = psi * A(phi) + B(phi),   A = sum L G D (1 - s) <n,w>,   B = sum L G D s <n,w>,   s = (1 - w.h)^5
"""

from __future__ import annotations

import numpy as np


def G1(x: np.ndarray, y: float) -> np.ndarray:
    """Smith's masking for GGX with 1 / (2 x) already in it: 1 / (x + sqrt(x^2 + y^2 - x^2 y^2)), y = phi."""
    return 1 / (x + np.sqrt(y * y + (1 - y * y) * (x * x)))


def G(n_w: np.ndarray, n_wo: np.ndarray, phi: float) -> np.ndarray:
    """Masking and shadowing over 4 (n.w) (n.wo), 1 / steradian-free: G1(n.w) G1(n.wo)."""
    return G1(n_w, phi) * G1(n_wo, phi)


def D(n_h: np.ndarray, phi: float) -> np.ndarray:
    """GGX's distribution of normals, per steradian: phi^2 / (pi (1 + (phi^2 - 1) (n.h)^2)^2)."""
    a = np.float32(phi * phi)
    # 1 - (n.h)^2 is formed first: at phi = 0.01 the sum above would lose all its digits in float32.
    square = n_h * n_h
    base = (1 - n_h) * (1 + n_h) + a * square
    return a / (np.float32(np.pi) * base * base)


def F(w_h: np.ndarray, psi: float) -> np.ndarray:
    """Schlick's Fresnel term: psi + (1 - psi) (1 - w.h)^5."""
    return psi + (1 - psi) * (1 - w_h) ** 5


def f_nd(n_w: np.ndarray, n_wo: np.ndarray, n_h: np.ndarray, w_h: np.ndarray, phi: float, psi: float) -> np.ndarray:
    """The non-diffuse BRDF, 1 / steradian."""
    return G(n_w, n_wo, phi) * D(n_h, phi) * F(w_h, psi)


def visible_normal_density(n_wo: np.ndarray, n_h: np.ndarray, phi: float) -> np.ndarray:
    """Solid-angle density of directions that come of sampling the normals visible from wo (Heitz, JCGT 2018).

    Smith's G1(wo) D(h) / (4 n.wo); with this module's `G1` that is G1 D / 2.
    """
    return G1(n_wo, phi) * D(n_h, phi) / 2


def sample_visible_normal(wo: np.ndarray, square: np.ndarray, phi: float) -> np.ndarray:
    """Normals h visible from wo, in the local frame (normal = +Z) (Heitz, JCGT 2018, listing 1).

    Parameters
    ----------
    wo : (n, 3) float32
        Unit, z > 0.
    square : (n, 2) float32
        Random numbers in [0, 1).

    Returns
    -------
    (n, 3) float32
    """
    stretched = wo * np.float32([phi, phi, 1])
    stretched /= np.linalg.norm(stretched, axis=1, keepdims=True)
    across = stretched[:, 0] ** 2 + stretched[:, 1] ** 2
    safe = np.sqrt(np.maximum(across, 1e-14))
    upright = across < 1e-12
    t1 = np.stack(
        [np.where(upright, 1, -stretched[:, 1] / safe), np.where(upright, 0, stretched[:, 0] / safe), 0 * safe], -1
    )
    t2 = np.cross(stretched, t1)
    radius, angle = np.sqrt(square[:, 0]), np.float32(2 * np.pi) * square[:, 1]
    p1, p2 = radius * np.cos(angle), radius * np.sin(angle)
    s = (1 + stretched[:, 2]) / 2
    p2 = (1 - s) * np.sqrt(np.maximum(1 - p1 * p1, 0)) + s * p2
    up = np.sqrt(np.maximum(1 - p1 * p1 - p2 * p2, 0))
    h = p1[:, None] * t1 + p2[:, None] * t2 + up[:, None] * stretched
    h = np.stack([phi * h[:, 0], phi * h[:, 1], np.maximum(h[:, 2], 1e-6)], -1)
    return (h / np.linalg.norm(h, axis=1, keepdims=True)).astype(np.float32)
