"""Reflected light of many observations for every phi of the grid at once: one set of rays, weighted anew for each phi.

Rays are drawn from a few lobes of different width (by visible normals, weights <= 1) and from the bright triangles; the
balance heuristic over all of them makes the same rays serve any phi in between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..parallel import for_blocks
from ..progress import Progress
from ..shading.directions import tangent_frame
from ..shading.emitters import BrightTriangles, aimed_density, sample_bright
from ..shading.field import LightField
from ..shading.irradiance import RAYS_AT_ONCE
from . import brdf

PROPOSALS = (0.015, 0.06, 0.2, 0.6)
"""Widths (phi) of the lobes that rays are drawn from."""
GRID = np.float32([0.01, 0.02, 0.035, 0.055, 0.08, 0.11, 0.15, 0.2, 0.26, 0.33, 0.41, 0.5, 0.6, 0.72, 0.85, 1.0])
"""phi of the grid search: close to equal steps in its square root, which is what Blender's users see."""


@dataclass(frozen=True)
class LobeLight:
    """I_nd(phi, psi) = psi * A + B for m observations.

    Attributes
    ----------
    A, B : (m, p, 3) float32
        For each phi of the grid; radiance, linear Rec.709.
    mirror : (m, 3) float32
        Radiance from the mirror direction.
    """

    A: np.ndarray
    B: np.ndarray
    mirror: np.ndarray


def _to_local(vector, tangent, bitangent, normal):
    return np.stack([np.einsum("ij,ij->i", vector, axis) for axis in (tangent, bitangent, normal)], -1)


def reflected_light(
    field: LightField,
    bright: BrightTriangles,
    triangle_normal: np.ndarray,
    element: np.ndarray,
    direction: np.ndarray,
    *,
    rays: int,
    grid: np.ndarray = GRID,
    threads: int = 0,
    seed: int = 0,
    progress: Progress | None = None,
) -> LobeLight:
    """A and B of every observation.

    Parameters
    ----------
    element : (m,) int
    direction : (m, 3) float32
        Unit, from the element to the camera (w_o).
    rays : int
        For each observation, shared between the lobes and the bright triangles.
    """
    m, p = len(element), len(grid)
    A, B = np.zeros((m, p, 3), np.float32), np.zeros((m, p, 3), np.float32)
    mirror = np.zeros((m, 3), np.float32)
    aimed = max(rays // (len(PROPOSALS) + 1), 1) if len(bright) else 0
    each = max((rays - aimed) // len(PROPOSALS), 1)

    def run(part: slice) -> None:
        rng = np.random.default_rng([seed, part.start])
        at = element[part]
        n, wo, position = field.atlas.normal[at], direction[part], field.atlas.position[at]
        count = len(at)
        tangent, bitangent = tangent_frame(n)
        local_wo = _to_local(wo, tangent, bitangent, n)
        local_wo[:, 2] = np.maximum(local_wo[:, 2], 1e-4)
        origin = field.scene.off_surface(position, n)
        drawn = [(2 * np.einsum("ij,ij->i", wo, n)[:, None] * n - wo)[:, None]]  # the mirror direction first
        for phi in PROPOSALS:
            out = np.repeat(local_wo, each, 0)
            square = _stratified(count, each, rng)
            h = brdf.sample_visible_normal(out, square, phi)
            w = 2 * np.einsum("ij,ij->i", out, h)[:, None] * h - out
            t, b, up = (np.repeat(axis, each, 0) for axis in (tangent, bitangent, n))
            drawn.append((w[:, :1] * t + w[:, 1:2] * b + w[:, 2:] * up).reshape(count, each, 3))
        if aimed:
            pick = sample_bright(bright, rng.random((count, aimed, 2), np.float32), rng)
            way = pick.point - np.repeat(origin, aimed, 0)
            drawn.append((way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)).reshape(count, aimed, 3))
        directions = np.concatenate(drawn, 1).astype(np.float32)
        k = directions.shape[1]
        flat = directions.reshape(-1, 3)
        n_w = np.einsum("mkj,mj->mk", directions, n)
        above = n_w.ravel() > 1e-4
        L = np.zeros((count * k, 3), np.float32)
        density = np.zeros(count * k, np.float32)
        hits = field.scene.intersect(np.repeat(origin, k, 0)[above], flat[above])
        L[above] = field.arriving(hits, field.elements(hits), flat[above])
        if aimed:
            density[above] = aimed * aimed_density(bright, hits, flat[above], triangle_normal)
        L = L.reshape(count, k, 3)
        mirror[part] = L[:, 0]
        L, density = L[:, 1:], density.reshape(count, k)[:, 1:]
        directions, n_w = directions[:, 1:], np.maximum(n_w[:, 1:], 1e-4)
        n_wo = local_wo[:, 2:]
        h = directions + wo[:, None]
        h /= np.maximum(np.sqrt(np.einsum("mkj,mkj->mk", h, h)), 1e-9)[..., None]
        n_h = np.clip(np.einsum("mkj,mj->mk", h, n), 1e-4, 1)
        s = (1 - np.clip(np.einsum("mkj,mkj->mk", h, directions), 0, 1)) ** 5
        for phi in PROPOSALS:
            density = density + each * brdf.visible_normal_density(n_wo, n_h, phi)
        weighted = L * (n_w / np.maximum(density, 1e-12))[..., None]
        both = np.concatenate([weighted * (1 - s)[..., None], weighted * s[..., None]], -1)
        f = np.empty((count, p, k - 1), np.float32)
        for i, phi in enumerate(grid):
            np.multiply(brdf.G(n_w, n_wo, float(phi)), brdf.D(n_h, float(phi)), out=f[:, i])
        summed = f @ both
        A[part], B[part] = summed[..., :3], summed[..., 3:]

    for_blocks(run, m, max(RAYS_AT_ONCE // rays, 1), threads, progress)
    return LobeLight(A, B, mirror)


def _stratified(count: int, each: int, rng: np.random.Generator) -> np.ndarray:
    """`each` points of the unit square for each of `count` observations, one in each stratum of either axis."""
    first = (np.arange(each, dtype=np.float32) + rng.random((count, each), np.float32)) / each
    second = (rng.permuted(np.tile(np.arange(each, dtype=np.float32), (count, 1)), axis=1) + 0.5) / each
    return np.stack([first, second], -1).reshape(-1, 2).astype(np.float32)
