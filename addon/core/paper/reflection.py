"""The light that the non-diffuse BRDF reflects, linear in psi (Haefner et al. 2021, sec. 3.4).

    I_nd(phi, psi) = integral of f_nd L <n, w> dw = psi A(phi) + B(phi)
    A = integral of G D (1 - s) L <n, w> dw,   B = integral of G D s L <n, w> dw,   s = (1 - <w, h>)^5

by the same uniform rays as the shading, which serve every phi at once.
"""

import numpy as np

from ..parallel import for_blocks
from ..scene.tangent_frame import tangent_frame
from .brdf import D, G, schlick
from .captured_light import Light
from .irradiance import RAYS_AT_ONCE, arriving


def reflected_parts(
    light: Light,
    position: np.ndarray,
    normal: np.ndarray,
    direction: np.ndarray,
    grid: np.ndarray,
    rays: int,
    *,
    threads: int = 0,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """A and B of m observations for each phi of a grid.

    Parameters
    ----------
    position, normal : (m, 3) float32
    direction : (m, 3) float32
        wo, unit, from the place to the camera.
    grid : (p,) float
        phi.
    rays : int
        N for each observation.

    Returns
    -------
    A, B : (m, p, 3) float32
        Radiance, linear Rec.709.
    """
    A, B = (np.zeros((len(position), len(grid), 3), np.float32) for _ in range(2))

    def run(part: slice) -> None:
        n = normal[part]
        L, w, _ = arriving(light, position[part], n, rays, np.random.default_rng([seed, part.start]))
        axes = np.stack([*tangent_frame(n), n], 1)
        wo = np.einsum("maj,mj->ma", axes, direction[part])[:, None]
        h = w + wo
        h /= np.maximum(np.linalg.norm(h, axis=2, keepdims=True), 1e-9)
        n_w, n_wo = w[..., 2], np.maximum(wo[..., 2], 1e-4)
        s = schlick(np.clip(np.einsum("mkj,mkj->mk", w, h), 0, 1))
        L *= (np.float32(2 * np.pi / rays) * n_w)[..., None]
        for i, phi in enumerate(grid):
            lobe = G(n_w, n_wo, phi) * D(h[..., 2], phi)
            A[part, i] = np.einsum("mk,mkc->mc", lobe * (1 - s), L)
            B[part, i] = np.einsum("mk,mkc->mc", lobe * s, L)

    for_blocks(run, len(position), max(RAYS_AT_ONCE // rays, 1), threads)
    return A, B
