"""The shading stage: from the lit diffuse texture to lamps, irradiance and albedo."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..capture.model import Instance, Mesh
from ..lit_diffuse.accumulate import ENOUGH, LitDiffuse
from ..lit_diffuse.visibility import CLEAN, SATURATED
from ..parallel import for_blocks
from ..progress import Progress
from ..surface.atlas import Atlas
from ..surface.elements import triangle_geometry
from ..surface.rays import RayScene
from .albedo import Albedo, fill, quotient
from .emitters import BrightTriangles, bright_triangles
from .environment import Environment
from .field import LightField
from .interpolate import interpolated
from .irradiance import direct, gather, uniform
from .lamps import Lamp
from .mirrors import Mirror
from .neighbourhood import doubt
from .portals import find_portals
from .texel_blocks import TexelBlocks
from .unseen_light import find_light

ELEMENTS_AT_ONCE = 1 << 13
BLOCK_EDGE = 0.004
"""Edge of the texel blocks that light is interpolated in, as a share of the elements' extent (or 2 texels)."""
SMOOTH = 0.05
"""Relative deviation of the lamps' light between a block's corners up to which it is interpolated."""
FINEST_TEXELS = 2.0
"""Least distance of two shading points, in texels."""


@dataclass(frozen=True)
class Shading:
    """What the shading stage finds, for n elements.

    Attributes
    ----------
    irradiance : (n, 3) float32
        E, radiance * steradian.
    escaped : (n,) float32
        Share of the hemisphere's rays that left the mesh.
    doubt : (n,) float32
        Relative error of `irradiance` by interpolation.
    radiance : (n, 3) float32
        L_d with everything filled in: what the light field shows at each element. Lamps have their own radiance.
    albedo : Albedo
    lamps : tuple of Lamp
    environment : Environment
        With the unseen sky solved for where it could be.
    notes : tuple of str
        What was solved for, one sentence each.
    mirrors : tuple of Mirror
        Flat mirrors that light was followed over.
    points : int
        Places at which the hemisphere was gathered.
    """

    irradiance: np.ndarray
    escaped: np.ndarray
    doubt: np.ndarray
    radiance: np.ndarray
    albedo: Albedo
    lamps: tuple[Lamp, ...]
    environment: Environment
    notes: tuple[str, ...]
    mirrors: tuple[Mirror, ...]
    points: int


def irradiance(
    field: LightField,
    normals: np.ndarray,
    element: np.ndarray,
    *,
    sampler: str,
    rays: int,
    emitter_rays: int,
    portal_rays: int,
    interpolate: bool,
    finest: float,
    threads: int,
    seed: int,
    progress: Progress | None = None,
) -> tuple[np.ndarray, np.ndarray, int, np.ndarray]:
    """E at chosen elements.

    Parameters
    ----------
    normals : (t, 3) float32
    element : (m,) int
        The elements wanted.
    sampler : str
        'aimed' or 'uniform' (the paper's).
    finest : float
        Least distance of two gathering points in metres.

    Returns
    -------
    irradiance : (m, 3) float32
    escaped : (m,) float32
    points : int
        How many places were gathered at.
    doubt : (m,) float32
        Relative error of E by interpolation.
    """
    atlas = field.atlas
    position, normal = atlas.position[element], atlas.normal[element]
    aimed = sampler == "aimed"
    bright: BrightTriangles = bright_triangles(field)
    lamp_rays = emitter_rays if aimed and len(bright) else 0
    portals = find_portals(field, seed) if aimed and portal_rays else None
    steps = {"count": 0}

    def gathered(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """E and the escaped share in four channels, and the radius R, at some of the elements."""
        value, radius = np.zeros((len(index), 4), np.float32), np.ones(len(index), np.float32)
        steps["count"] += 1

        def run(part: slice) -> None:
            at = index[part]
            here = seed + 7919 * steps["count"] + part.start
            if aimed:
                found = gather(
                    field, bright, position[at], normal[at], rays, lamp_rays, here, portals, portal_rays
                )
                value[part, :3], radius[part], value[part, 3] = found
            else:
                value[part, :3], value[part, 3] = uniform(field, position[at], normal[at], rays, here)

        for_blocks(run, len(index), max(ELEMENTS_AT_ONCE * 64 // rays, 64), threads, progress)
        return value, radius

    cached = interpolate and aimed
    blocks = TexelBlocks(atlas, element, threads)
    step = block_step(atlas, finest) if cached else 1
    points = 0

    def around(index: np.ndarray) -> np.ndarray:
        """E, the escaped share and the contrast, (k, 5) float32."""
        nonlocal points
        if not cached:
            points += len(index)
            return np.concatenate([gathered(index)[0], np.zeros((len(index), 1), np.float32)], 1)
        value, chosen, contrast = interpolated(position[index], normal[index], lambda i: gathered(index[i]), finest, threads)
        points += len(chosen)
        return np.concatenate([value, contrast[:, None]], 1)

    def aim(index: np.ndarray) -> np.ndarray:
        """The lamps' part of E, (k, 3) float32."""
        found = np.empty((len(index), 3), np.float32)

        def run(part: slice) -> None:
            at = index[part]
            found[part] = direct(field, bright, position[at], normal[at], rays, lamp_rays, seed + 1 + part.start)

        for_blocks(run, len(index), ELEMENTS_AT_ONCE, threads, progress)
        return found

    value = blocks.evaluate(around, step, np.inf)
    total, escaped, contrast = value[:, :3].copy(), value[:, 3].copy(), value[:, 4]
    if lamp_rays:
        total += blocks.evaluate(aim, step, SMOOTH, total.mean(1))
    share = value[:, :3].mean(1) / np.maximum(total.mean(1), 1e-20)
    return total, escaped, points, contrast * share


def block_step(atlas: Atlas, finest: float) -> int:
    """Edge in texels of the blocks that light is interpolated in: a power of two, at least 2 texels."""
    extent = np.sort(np.ptp(atlas.position, axis=0))
    largest = max(BLOCK_EDGE * float(np.sqrt(extent[1] * extent[2])), finest)
    return 1 << int(np.log2(largest / float(np.sqrt(np.median(atlas.area))) + 1e-6))


def fill_unseen(radiance: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """L_d with the unseen elements dark, as (n, 3) float32 without NaN."""
    return np.where(seen[:, None], radiance, np.float32(0)).astype(np.float32)


def shade(
    mesh: Mesh,
    instances: tuple[Instance, ...],
    atlas: Atlas,
    scene: RayScene,
    lit_diffuse: LitDiffuse,
    environment: Environment,
    *,
    sampler: str = "aimed",
    rays: int = 256,
    emitter_rays: int = 16,
    portal_rays: int = 32,
    interpolate: bool = True,
    threads: int = 0,
    seed: int = 0,
    progress: Progress | None = None,
    find_mirrors: Callable[[LightField, tuple[Lamp, ...]], tuple[Mirror, ...]] | None = None,
) -> Shading:
    """Lamps, irradiance and albedo (Haefner et al. 2021, sec. 3.2, with aimed rays and interpolation by default).

    Parameters
    ----------
    find_mirrors : callable, optional
        Tells the flat mirrors once the lamps are known; light is then followed over them.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    normals, _ = triangle_geometry(mesh)
    class_of = {i.object_id: i.class_name for i in instances}
    seen = lit_diffuse.seen
    objects = int(atlas.object_id.max()) + 1
    surface = np.bincount(atlas.object_id, atlas.area, objects)
    seen_surface = np.bincount(atlas.object_id, atlas.area * seen, objects)
    seen_share = {i: float(seen_surface[i] / surface[i]) for i in np.unique(atlas.object_id) if surface[i] > 0}
    finest = FINEST_TEXELS * float(np.sqrt(np.median(atlas.area)))
    how = {"sampler": sampler, "threads": threads, "seed": seed}

    # 1. All light. What nobody saw is dark at first, so that a lamp among it is missed and can be solved for.
    field = LightField(mesh, atlas, scene, fill_unseen(lit_diffuse.radiance, seen), environment)
    good = seen & (((lit_diffuse.tier == CLEAN) & (lit_diffuse.count >= ENOUGH)) | (lit_diffuse.tier == SATURATED))
    unseen = [object_id for object_id, share in seen_share.items() if share == 0]
    light = find_light(field, normals, good if good.any() else seen, unseen, instances, seed)
    lamps = light.lamps
    radiance = field.radiance.copy()
    for lamp in lamps:
        own = atlas.object_id == lamp.object_id
        # At its edges the surroundings are mixed in.
        radiance[own & (lit_diffuse.tier != CLEAN) if lamp.seen else own] = lamp.radiance
    emitters = {lamp.object_id for lamp in lamps}
    field = field.with_light(radiance, light.environment, emitters)

    mirrors = find_mirrors(field, lamps) if find_mirrors else ()
    field = field.with_mirrors(mirrors)

    # 2. What nobody saw reflects like the rest of its object under the light that reaches it: a rough first pass.
    unseen_lamp = ~seen & np.isin(atlas.object_id, list(emitters))
    dark = np.flatnonzero(~seen & ~unseen_lamp)
    lit = np.flatnonzero(seen | unseen_lamp)
    if len(dark):
        rough = dict(how, rays=64, emitter_rays=4, portal_rays=8, interpolate=True, finest=8 * finest) | {"sampler": "aimed"}
        coarse_lit, _, _, _ = irradiance(field, normals, lit, **rough)
        coarse_dark, escaped_dark, _, _ = irradiance(field, normals, dark, **rough)
        everywhere = np.zeros((len(atlas), 3), np.float32)
        everywhere[lit], everywhere[dark] = coarse_lit, coarse_dark
        rho, valid = quotient(lit_diffuse.radiance, everywhere)
        guess = fill(atlas, rho, valid, class_of, emitters)
        radiance[dark] = guess.rho[dark] * everywhere[dark] / np.float32(np.pi)
        field = field.with_light(radiance)

    # 3. The real thing, where there is an L_d to divide; elsewhere the rough values do.
    E = np.zeros((len(atlas), 3), np.float32)
    escaped, unsure = np.zeros(len(atlas), np.float32), np.zeros(len(atlas), np.float32)
    if len(dark):
        E[dark], escaped[dark] = coarse_dark, escaped_dark
    E[lit], escaped[lit], points, unsure[lit] = irradiance(
        field, normals, lit, rays=rays, emitter_rays=emitter_rays, portal_rays=portal_rays,
        interpolate=interpolate, finest=finest, progress=progress, **how,
    )  # fmt: skip
    rho, valid = quotient(lit_diffuse.radiance, E)
    albedo = fill(atlas, rho, valid & seen, class_of, emitters, np.hypot(doubt(lit_diffuse), unsure))
    return Shading(E, escaped, unsure, field.radiance, albedo, lamps, light.environment, light.notes, mirrors, points)
