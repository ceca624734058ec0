"""The converged irradiance that the shading benchmarks measure against."""

from __future__ import annotations

import numpy as np

from ..core.kinds import Workload
from ..core.light.directions import cosine_hemisphere, shifted, sobol
from ..core.light.emitters import bright_triangles
from ..core.light.irradiance import direct, gather
from ..core.light.portals import find_portals
from ..core.parallel import for_blocks
from ..core.scene.tangent_frame import to_world
from .lit_rooms import LitRoom
from .run import Options

REFERENCE: Workload[tuple[int, int, int]] = (1 << 13, 1 << 11, 1 << 12)
"""Gather, lamp and portal rays of the reference."""
HIDDEN: Workload[float] = 0.02
"""Elements darker than this share of the median are not looked at."""


def looked_at(room: LitRoom, count: int, options: Options) -> tuple[np.ndarray, np.ndarray]:
    """Elements spread over the surface ((m,) int), and their converged E ((m, 3) float32).

    Lamps are left out, and what lies under or inside the furniture: no frame would see it.
    """
    plain = np.flatnonzero(~np.isin(room.atlas.object_id, room.lamps))
    element = np.sort(np.random.default_rng(options.seed).choice(plain, min(count, len(plain)), replace=False))
    true = reference(room, element, options)
    level = true.mean(1)
    seen = level > HIDDEN * np.median(level)
    if room.exact is not None:
        seen = _enclosed(room, element, options.seed) < 0.9
    return element[seen], true[seen]


def _enclosed(room: LitRoom, element: np.ndarray, seed: int) -> np.ndarray:
    """Share of the hemisphere's rays that meet the back of a triangle, as from inside a box."""
    position, normal = room.atlas.position[element], room.atlas.normal[element]
    local = cosine_hemisphere(shifted(sobol(64, seed), len(element), np.random.default_rng(seed)))
    directions = to_world(local, normal).reshape(-1, 3)
    scene = room.field.scene
    hits = scene.intersect(np.repeat(scene.off_surface(position, normal), 64, 0), directions)
    back = np.einsum("ij,ij->i", directions, room.field.normal[hits.triangle]) > 0
    return (back & (hits.triangle >= 0)).reshape(len(element), 64).mean(1)


def reference(room: LitRoom, element: np.ndarray, options: Options) -> np.ndarray:
    """Converged E at elements, (m, 3) float32; checked against more rays in tests."""
    if room.exact is not None:
        return np.full((len(element), 3), room.exact, np.float32)
    field, E = room.field, np.empty((len(element), 3), np.float32)
    bright, portals = bright_triangles(field), find_portals(field, options.seed)
    position, normal = room.atlas.position[element], room.atlas.normal[element]
    rays, lamp_rays, portal_rays = REFERENCE
    lamp_rays = lamp_rays if len(bright) else 0

    def run(part: slice) -> None:
        p, n, own = position[part], normal[part], options.seed + 31 + part.start
        around, _, _ = gather(field, bright, p, n, rays, lamp_rays, own, portals, portal_rays)
        E[part] = around + direct(field, bright, p, n, rays, lamp_rays, own + 1)[0]

    for_blocks(run, len(element), 16, options.threads)
    return E


def relative_error(E: np.ndarray, true: np.ndarray) -> float:
    """Root mean square of the relative error of mean E."""
    return float(np.sqrt(np.mean((E.mean(1) / true.mean(1) - 1) ** 2)))
