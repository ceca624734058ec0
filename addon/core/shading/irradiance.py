"""Irradiance E(x) = integral of L(x, w) <w, n> dw at surface elements (the paper's shading S, its units put right).

Two estimators that add up: rays aimed at bright triangles (`direct`) and rays over the hemisphere (`gather`). Each
direction's radiance is shared between them by the balance heuristic (Veach and Guibas 1995), so neither the lamp's
noise nor its 1/r^2 is left to the other. The weights depend on the geometry alone: the two parts may be sampled at
different places, which lets the smooth part be gathered at few points and interpolated.
"""

from __future__ import annotations

import numpy as np

from .directions import cosine_hemisphere, shifted, sobol, to_world, uniform_hemisphere
from .emitters import BrightTriangles, aimed_density, sample_bright
from .field import LightField
from .over_mirrors import direct_over_mirrors

RAYS_AT_ONCE = 1 << 18


def gather(
    field: LightField,
    bright: BrightTriangles,
    triangle_normal: np.ndarray,
    position: np.ndarray,
    normal: np.ndarray,
    rays: int,
    emitter_rays: int,
    seed: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The hemisphere's part of E by cosine-distributed rays.

    Parameters
    ----------
    triangle_normal : (t, 3) float32
    position, normal : (n, 3) float32
    rays : int
        For each point, drawn from one scrambled Sobol pattern, shifted for each point.
    emitter_rays : int
        How many rays `direct` spends: what the balance heuristic needs to know. 0: everything is gathered here.

    Returns
    -------
    irradiance : (n, 3) float32
        Radiance * steradian, linear Rec.709.
    radius : (n,) float32
        Harmonic mean distance of the surroundings, metres (Ward et al. 1988): how far this value holds.
    escaped : (n,) float32
        Share of the rays that left the mesh.
    """
    rng = np.random.default_rng(seed)
    pattern = sobol(rays, seed)
    total = np.zeros((len(position), 3), np.float32)
    radius, escaped = np.zeros(len(position), np.float32), np.zeros(len(position), np.float32)
    step = max(RAYS_AT_ONCE // rays, 1)
    for start in range(0, len(position), step):
        part = slice(start, start + step)
        p, n = position[part], normal[part]
        local = cosine_hemisphere(shifted(pattern, len(p), rng))
        directions = to_world(local, n).reshape(-1, 3)
        origins = np.repeat(field.scene.off_surface(p, n), rays, 0)
        hits = field.scene.intersect(origins, directions)
        element = field.elements(hits)
        # What a mirror shows of the bright triangles is aimed at below; here it would come as fireflies.
        radiance = field.arriving(hits, element, directions, bright.density if emitter_rays else None)
        out = element < 0
        if emitter_rays and len(bright):
            aimed = aimed_density(bright, hits, directions, triangle_normal)
            own = rays * local[..., 2].reshape(-1) / np.float32(np.pi)
            radiance *= (own / np.maximum(own + emitter_rays * aimed, 1e-20))[:, None]
        total[part] = np.float32(np.pi / rays) * radiance.reshape(len(p), rays, 3).sum(1)
        radius[part] = rays / np.maximum((1 / np.maximum(hits.distance, 1e-9)).reshape(len(p), rays).sum(1), 1e-20)
        escaped[part] = out.reshape(len(p), rays).mean(1)
    if emitter_rays and field.mirrors:
        total += direct_over_mirrors(field, bright, position, normal, emitter_rays, seed)
    return total, radius, escaped


def direct(
    field: LightField,
    bright: BrightTriangles,
    position: np.ndarray,
    normal: np.ndarray,
    rays: int,
    emitter_rays: int,
    seed: int,
) -> np.ndarray:
    """The bright triangles' part of E by rays aimed at points on them.

    Parameters
    ----------
    rays : int
        How many rays `gather` spends at a point; what the balance heuristic needs to know.
    emitter_rays : int
        For each point.

    Returns
    -------
    (n, 3) float32
        Radiance * steradian.
    """
    total = np.zeros((len(position), 3), np.float32)
    if not len(bright) or not emitter_rays:
        return total
    rng = np.random.default_rng(seed)
    pattern = sobol(emitter_rays, seed)
    step = max(RAYS_AT_ONCE // emitter_rays, 1)
    for start in range(0, len(position), step):
        part = slice(start, start + step)
        p, n = position[part], normal[part]
        pick = sample_bright(bright, shifted(pattern, len(p), rng), rng)
        origin = np.repeat(field.scene.off_surface(p, n), emitter_rays, 0)
        way = pick.point - origin
        distance = np.sqrt(np.einsum("ij,ij->i", way, way))
        direction = way / np.maximum(distance, 1e-12)[:, None]
        cosine = np.einsum("ijk,ik->ij", direction.reshape(len(p), emitter_rays, 3), n).ravel()
        facing = -np.einsum("ij,ij->i", direction, bright.normal[pick.index])
        behind = field.one_sided[pick.triangle] & (facing < 0)
        facing = np.abs(facing)
        useful = np.flatnonzero((cosine > 0) & (facing > 1e-6) & (distance > 10 * field.scene.offset) & ~behind)
        hidden = field.scene.occluded(
            origin[useful], direction[useful], distance[useful] * np.float32(1 - 1e-4) - field.scene.offset
        )
        useful = useful[~hidden]
        aimed = pick.density[useful] * distance[useful] ** 2 / facing[useful]
        element = field.lookup(pick.triangle[useful], pick.u[useful], pick.v[useful])
        share = emitter_rays * aimed + rays * cosine[useful] / np.float32(np.pi)
        value = np.zeros((len(way), 3), np.float32)
        value[useful] = field.radiance[element] * (cosine[useful] / np.maximum(share, 1e-20))[:, None]
        total[part] = value.reshape(len(p), emitter_rays, 3).sum(1)
    return total


def uniform(
    field: LightField, position: np.ndarray, normal: np.ndarray, rays: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """The paper's estimator: `rays` independent uniform directions; E = 2 pi / N * sum of L <w, n> (eq. 3 and 4).

    Returns
    -------
    irradiance : (n, 3) float32
    escaped : (n,) float32
    """
    rng = np.random.default_rng(seed)
    total = np.zeros((len(position), 3), np.float32)
    escaped = np.zeros(len(position), np.float32)
    step = max(RAYS_AT_ONCE // rays, 1)
    for start in range(0, len(position), step):
        part = slice(start, start + step)
        p, n = position[part], normal[part]
        local = uniform_hemisphere(rng.random((len(p), rays, 2), np.float32))
        directions = to_world(local, n).reshape(-1, 3)
        radiance, _, element = field.along(np.repeat(field.scene.off_surface(p, n), rays, 0), directions)
        weighted = radiance.reshape(len(p), rays, 3) * local[..., 2:3]
        total[part] = np.float32(2 * np.pi / rays) * weighted.sum(1)
        escaped[part] = (element < 0).reshape(len(p), rays).mean(1)
    return total, escaped
