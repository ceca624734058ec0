"""Irradiance E(x) = integral of L(x, w) <w, n> dw at surface elements (the paper's shading S, its units put right).

Two estimators that add up: rays aimed at bright triangles (`direct`) and rays over the hemisphere (`gather`). Each
direction's radiance is shared between them by the balance heuristic (Veach and Guibas 1995), so neither the lamp's
noise nor its 1/r^2 is left to the other. The weights depend on the geometry alone: the two parts may be sampled at
different places, which lets the smooth part be gathered at few points and interpolated.
"""

import numpy as np

from ..kinds import Block
from ..parallel import blocks
from .directions import PATTERNS, cosine_patterns, shifted, sobol, turned
from .emitters import BrightTriangles, aimed_at, sample_bright
from .field import LightField
from .over_mirrors import direct_over_mirrors
from .params import GATHER
from .portals import Portals

RAYS_AT_ONCE: Block[int] = 1 << 16


def gather(
    field: LightField,
    bright: BrightTriangles,
    position: np.ndarray,
    normal: np.ndarray,
    rays: int,
    emitter_rays: int,
    seed: int,
    portals: Portals | None = None,
    portal_rays: int = 0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The hemisphere's part of E by cosine-distributed rays, and rays aimed at the portals.

    Parameters
    ----------
    position, normal : (n, 3) float32
    rays : int
        For each point: one of a few scrambled Sobol patterns, turned by an angle of its own.
    emitter_rays : int
        How many rays `direct` spends: what the balance heuristic needs to know. 0: everything is gathered here.
    portals : Portals, optional
        Where light comes in from outside.
    portal_rays : int
        For each point, aimed at the portals.

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
    patterns = cosine_patterns(rays, seed)
    portal_rays = portal_rays if portals is not None else 0
    total = np.zeros((len(position), 3), np.float32)
    radius, escaped = np.zeros(len(position), np.float32), np.zeros(len(position), np.float32)
    for part in blocks(len(position), max(RAYS_AT_ONCE // rays, 1)):
        p, n = position[part], normal[part]
        directions, cosine = turned(patterns, n, rng)
        directions, cosine = directions.reshape(-1, 3), cosine.ravel()
        origins = np.repeat(field.scene.off_surface(p, n), rays, 0)
        hits = field.scene.intersect(origins, directions)
        # What a mirror shows of the bright triangles is aimed at below; here it would come as fireflies.
        radiance = field.arriving(
            hits, field.elements(hits), directions, bright.density if emitter_rays else None, origins
        )
        escapes = hits.triangle < 0
        if emitter_rays and len(bright):
            index, aimed = aimed_at(bright, hits, directions, field.normal)
            radiance[index] *= balance(rays * cosine[index], emitter_rays * aimed)[:, None]
        if portals is not None and portal_rays:
            index = np.flatnonzero(escapes)
            density = portals.aimed_density(origins[index], directions[index])
            radiance[index] *= balance(rays * cosine[index], portal_rays * density)[:, None]
        total[part] = np.float32(np.pi / rays) * np.einsum("nkc->nc", radiance.reshape(len(p), rays, 3))
        inverse_distance = np.einsum("nk->n", 1 / np.maximum(hits.distance, 1e-9).reshape(len(p), rays))
        radius[part] = rays / np.maximum(inverse_distance, 1e-20)
        escaped[part] = escapes.reshape(len(p), rays).mean(1)
    if portals is not None and portal_rays:
        total += from_outside(field, portals, position, normal, rays, portal_rays, seed)
    if emitter_rays and field.mirrors:
        total += direct_over_mirrors(field, bright, position, normal, emitter_rays, seed)
    return total, radius, escaped


def balance(cosine_rays: np.ndarray, aimed: np.ndarray) -> np.ndarray:
    """The balance heuristic's weight of cosine-distributed rays, (n,); `aimed` is rays times density."""
    density = cosine_rays / np.float32(np.pi)
    return density / np.maximum(density + aimed, 1e-20)


def from_outside(
    field: LightField,
    portals: Portals,
    position: np.ndarray,
    normal: np.ndarray,
    rays: int,
    portal_rays: int,
    seed: int,
) -> np.ndarray:
    """The outside's part of E by rays aimed at the portals, (n, 3) float32; `rays` as for `direct`."""
    total = np.zeros((len(position), 3), np.float32)
    rng = np.random.default_rng([seed, 1])
    patterns = shifted(sobol(portal_rays, seed), PATTERNS, rng)
    for part in blocks(len(position), max(RAYS_AT_ONCE // portal_rays, 1)):
        p, n = position[part], normal[part]
        origins = field.scene.off_surface(p, n)
        square = patterns[rng.integers(0, PATTERNS, len(p))]
        directions, density = portals.sample(origins, square, rng)
        cosine = np.einsum("nkj,nj->nk", directions.reshape(len(p), portal_rays, 3), n).ravel()
        useful = np.flatnonzero(cosine > 0)
        starts = np.repeat(origins, portal_rays, 0)
        hidden = field.scene.occluded(starts[useful], directions[useful], np.full(len(useful), np.inf, np.float32))
        useful = useful[~hidden]
        weight = cosine[useful] / (portal_rays * density[useful] + rays * cosine[useful] / np.float32(np.pi))
        light = np.zeros((len(directions), 3), np.float32)
        light[useful] = field.outside(starts[useful], directions[useful]) * weight[:, None]
        total[part] = light.reshape(len(p), portal_rays, 3).sum(1)
        total[part][~portals.around(origins)] = 0
    return total


def direct(
    field: LightField,
    bright: BrightTriangles,
    position: np.ndarray,
    normal: np.ndarray,
    rays: int,
    emitter_rays: int,
    seed: int,
) -> tuple[np.ndarray, np.ndarray]:
    """The bright triangles' part of E by rays aimed at points on them.

    Parameters
    ----------
    rays : int
        How many rays `gather` spends at a point; what the balance heuristic needs to know.
    emitter_rays : int
        For each point.

    Returns
    -------
    irradiance : (n, 3) float32
        Radiance * steradian.
    noise : (n,) float32
        Its standard error, mean of the channels: how far the first half of the rays is from the second, less
        `both_halves`. One place's own says little.
    """
    total, noise = np.zeros((len(position), 3), np.float32), np.zeros(len(position), np.float32)
    if not len(bright) or not emitter_rays:
        return total, noise
    rng = np.random.default_rng(seed)
    # The receivers share a few patterns of points: all that depends on the point alone is looked up once.
    pick = sample_bright(bright, shifted(sobol(emitter_rays, seed, 3), PATTERNS, rng))
    light = field.radiance[field.lookup(pick.triangle, pick.u, pick.v)].reshape(PATTERNS, emitter_rays, 3)
    point = pick.point.reshape(PATTERNS, emitter_rays, 3)
    outward = bright.normal[pick.index].reshape(PATTERNS, emitter_rays, 3)
    density = pick.density.reshape(PATTERNS, emitter_rays)
    one_sided = field.one_sided[pick.triangle].reshape(PATTERNS, emitter_rays)
    for part in blocks(len(position), max(RAYS_AT_ONCE // emitter_rays, 1)):
        n = normal[part]
        pattern = rng.integers(0, PATTERNS, len(n))
        origin = field.scene.off_surface(position[part], n)
        direction = point[pattern] - origin[:, None]
        distance = np.sqrt(np.einsum("ijk,ijk->ij", direction, direction))
        direction /= np.maximum(distance, 1e-12)[..., None]
        cosine = np.matmul(direction, n[:, :, None])[..., 0]
        facing = -np.einsum("ijk,ijk->ij", direction, outward[pattern])
        behind = one_sided[pattern] & (facing < 0)
        facing = np.abs(facing)
        seen = (cosine > 0) & (facing > 1e-6) & (distance > 10 * field.scene.offset) & ~behind
        row, ray = np.nonzero(seen)
        hidden = field.scene.occluded(
            origin[row], direction[row, ray], distance[row, ray] * np.float32(1 - 1e-4) - field.scene.offset
        )
        row, ray = row[~hidden], ray[~hidden]
        cosine, facing = cosine[row, ray], facing[row, ray]
        aimed = density[pattern[row], ray] * distance[row, ray] ** 2 / facing
        share = emitter_rays * aimed + rays * cosine / np.float32(np.pi)
        weight = np.zeros(distance.shape, np.float32)
        weight[row, ray] = cosine / np.maximum(share, 1e-20)
        radiance = light[pattern]
        total[part] = np.matmul(weight[:, None], radiance)[:, 0]
        weight[:, emitter_rays // 2 :] *= -1
        noise[part] = GATHER.both_halves * np.abs(np.matmul(weight[:, None], radiance)[:, 0]).mean(1)
    return total, noise
