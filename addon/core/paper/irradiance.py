"""Shading S by N uniform rays (Haefner et al. 2021, sec. 3.2, eq. 3 and 4).

    S(x) = integral of L(x, w) <n, w> dw  ~  2 pi / N  sum of L(x, w_i) <n, w_i>,   w_i uniform over the hemisphere

The paper leaves 2 pi / N out, and pi out of the albedo; with them S is the irradiance E in radiance * steradian.
"""

import numpy as np

from ..kinds import Block
from ..parallel import for_blocks
from ..progress import Progress, Rounds
from ..scene.tangent_frame import to_world
from .captured_light import Light

RAYS_AT_ONCE: Block[int] = 1 << 16


def uniform_hemisphere(square: np.ndarray) -> np.ndarray:
    """Points of the unit square to directions with density 1 / (2 pi) about +Z; (..., 2) -> (..., 3) float32."""
    height = square[..., 0]
    radius, angle = np.sqrt(np.maximum(1 - height * height, 0)), np.float32(2 * np.pi) * square[..., 1]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], -1).astype(np.float32)


def arriving(
    light: Light, position: np.ndarray, normal: np.ndarray, rays: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """L(x, w_i) at m places from `rays` uniform directions each.

    Parameters
    ----------
    position, normal : (m, 3) float32

    Returns
    -------
    radiance : (m, rays, 3) float32
    directions : (m, rays, 3) float32
        w_i, about +Z as the normal.
    escaped : (m, rays) bool
        Which of the rays left the mesh.
    """
    local = uniform_hemisphere(rng.random((len(position), rays, 2), np.float32))
    origins = np.repeat(light.scene.off_surface(position, normal), rays, 0)
    radiance, _, element = light.along(origins, to_world(local, normal).reshape(-1, 3))
    return radiance.reshape(local.shape), local, (element < 0).reshape(local.shape[:2])


def irradiance(
    light: Light,
    position: np.ndarray,
    normal: np.ndarray,
    rays: int,
    *,
    threads: int = 0,
    seed: int = 0,
    progress: Progress | Rounds | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """S of m places.

    Parameters
    ----------
    position, normal : (m, 3) float32
    rays : int
        N; the paper has 100 and 10,000.

    Returns
    -------
    irradiance : (m, 3) float32
        Radiance * steradian, linear Rec.709.
    escaped : (m,) float32
        Share of the rays that left the mesh.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    S, escaped = np.zeros((len(position), 3), np.float32), np.zeros(len(position), np.float32)

    def run(part: slice) -> None:
        rng = np.random.default_rng([seed, part.start])
        L, w, left_mesh = arriving(light, position[part], normal[part], rays, rng)
        S[part] = np.float32(2 * np.pi / rays) * np.einsum("mkc,mk->mc", L, w[..., 2])
        escaped[part] = left_mesh.mean(1)

    for_blocks(run, len(position), max(RAYS_AT_ONCE // rays, 1), threads, progress)
    return S, escaped
