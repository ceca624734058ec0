"""The non-diffuse BRDF f_nd = G D F (Haefner et al. 2021, eq. 6 to 9).

Directions as in the paper: n the normal, w towards the light, wo towards the camera, h their half vector; all
arguments are cosines, of one shape or shapes that broadcast. phi is the width of GGX's lobe, known as alpha elsewhere;
psi is the reflectance at normal incidence, F0.
"""

import numpy as np


def f_nd(
    n_w: np.ndarray, n_wo: np.ndarray, n_h: np.ndarray, w_h: np.ndarray, phi: float, psi: float | np.ndarray
) -> np.ndarray:
    """The non-diffuse BRDF, 1 / steradian."""
    return G(n_w, n_wo, phi) * D(n_h, phi) * F(w_h, psi)


def G(n_w: np.ndarray, n_wo: np.ndarray, phi: float) -> np.ndarray:
    """Masking and shadowing, with the microfacet model's 1 / (4 (n.w) (n.wo)) in it: G1(n.w) G1(n.wo)."""
    return G1(n_w, phi) * G1(n_wo, phi)


def G1(x: np.ndarray, y: float) -> np.ndarray:
    """Smith's masking of GGX over 2 x: 1 / (x + sqrt(x^2 + y^2 - x^2 y^2)), x a cosine and y = phi."""
    return 1 / (x + np.sqrt(y * y + (1 - y * y) * (x * x)))


def D(n_h: np.ndarray, phi: float) -> np.ndarray:
    """GGX's distribution of normals, 1 / steradian: phi^2 / (pi (1 + (phi^2 - 1) (n.h)^2)^2)."""
    square = np.float32(phi * phi)
    # 1 - (n.h)^2 is formed first: at phi = 0.01 the sum above would lose all its digits in float32.
    base = (1 - n_h) * (1 + n_h) + square * (n_h * n_h)
    return square / (np.float32(np.pi) * base * base)


def F(w_h: np.ndarray, psi: float | np.ndarray) -> np.ndarray:
    """Schlick's Fresnel term: psi + (1 - psi) (1 - w.h)^5."""
    return psi + (1 - psi) * schlick(w_h)


def schlick(w_h: np.ndarray) -> np.ndarray:
    """What F has of light that psi has no part in, s = (1 - w.h)^5: F = psi (1 - s) + s."""
    return (1 - w_h) ** 5
