"""Cosine-distributed directions over the hemisphere, and well-spread points to make them of."""

import numpy as np
from scipy.stats import qmc

from ..scene.tangent_frame import tangent_frame
from .params import GATHER


def sobol(count: int, seed: int, axes: int = 2) -> np.ndarray:
    """`count` scrambled Sobol points in the unit square or cube, (count, axes) float32."""
    power = int(np.ceil(np.log2(max(count, 1))))
    return qmc.Sobol(axes, scramble=True, seed=seed).random_base2(power)[:count].astype(np.float32)


def shifted(points: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """The pattern once for each of `count` receivers, each moved by its own random shift modulo 1: (count, k, axes)."""
    return (points[None] + rng.random((count, 1, points.shape[1]), np.float32)) % np.float32(1)


def cosine_hemisphere(square: np.ndarray) -> np.ndarray:
    """Points of the unit square to directions with density cos / pi about +Z; (..., 2) -> (..., 3) float32."""
    radius, angle = np.sqrt(square[..., 0]), np.float32(2 * np.pi) * square[..., 1]
    height = np.sqrt(np.maximum(1 - square[..., 0], 0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], -1).astype(np.float32)


PATTERNS = GATHER.patterns


def cosine_patterns(rays: int, seed: int) -> np.ndarray:
    """`PATTERNS` different sets of `rays` cosine-distributed directions about +Z: (PATTERNS, rays, 3) float32.

    Each is a scrambled Sobol set moved by a shift of its own.
    """
    return cosine_hemisphere(shifted(sobol(rays, seed), PATTERNS, np.random.default_rng(seed)))


def turned(patterns: np.ndarray, normal: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """One of the patterns about each normal, turned by an angle of its own.

    As good as a shift of its own for each receiver (measured: the same error), at an eighth of its time.

    Parameters
    ----------
    patterns : (p, k, 3) float32
    normal : (n, 3) float32

    Returns
    -------
    directions : (n, k, 3) float32
        World.
    cosine : (n, k) float32
        To the normal.
    """
    tangent, bitangent = tangent_frame(normal)
    angle = rng.random(len(normal), np.float32) * np.float32(2 * np.pi)
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    frame = np.stack([cos * tangent + sin * bitangent, cos * bitangent - sin * tangent, normal], 1)
    chosen = rng.integers(0, len(patterns), len(normal))
    return np.matmul(patterns[chosen], frame), patterns[chosen, :, 2]
