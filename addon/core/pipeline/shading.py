"""The shading stage: from the lit diffuse texture to lamps, irradiance and albedo."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..light.environment import Environment
from ..light.few_elements import evened
from ..light.field import LightField
from ..light.lamps import Lamp
from ..light.mirrors import Mirror, known_mirror
from ..light.over_surface import finest_spacing, irradiance
from ..light.shading import Shading
from ..light.sun import Sun, taken_out
from ..passes.albedo.albedo import MAX_ALBEDO, fill, quotient
from ..passes.clipped_lamps.clipped import shade_clipped
from ..passes.mirrors.flat_mirrors import find_mirrors
from ..passes.unseen_light.shades import BOUNCES, strongly_lit
from ..progress import Progress
from ..scene.atlas import Atlas
from ..scene.creases import crease_doubt
from ..scene.lit_diffuse import ENOUGH, LitDiffuse
from ..scene.mesh_noise import tilt
from ..scene.model import Capture, Instance, Mesh
from ..scene.rays import RayScene
from ..scene.surface import Surface
from ..scene.two_sides import fronts
from ..scene.visibility import CLEAN, SATURATED
from ..settings import Settings
from .find_light import find_all_light
from .frames import STAGE as FRAMES
from .frames import Observed
from .stage import Stage
from .surface import STAGE as SURFACE

STAGE = Stage(
    "shading",
    Path(__file__),
    (SURFACE, FRAMES),
    ("shading", "shading_rays", "emitter_rays", "portal_rays", "interpolate", "mirrors", "seed"),
)


def find_shading(
    capture: Capture, surface: Surface, observed: Observed, settings: Settings, progress: Progress
) -> Shading:
    """The light of a capture: `shade` with what the frames show of mirrors, and of lamps that they clip."""
    s = settings

    def mirrors(field: LightField, lamps: tuple[Lamp, ...] | None) -> tuple[Mirror, ...]:
        found = find_mirrors(field, lamps or (), observed.samples, capture.instances, s.seed)
        told = [known_mirror(mirror, field.mesh) for mirror in capture.mirrors]
        return (*found, *(one for one in told if one.object_id not in {mirror.object_id for mirror in found}))

    def shaded(lit: LitDiffuse) -> Shading:
        return shade(
            surface.mesh, capture.instances, surface.atlas, surface.scene, lit, observed.environment,
            sampler=s.shading, rays=s.shading_rays, emitter_rays=s.emitter_rays, portal_rays=s.portal_rays,
            interpolate=s.interpolate, threads=s.threads, seed=s.seed, progress=progress,
            find_mirrors=mirrors if s.mirrors else None, noise=surface.noise,
            colours=observed.fringes.colours(), without=s.without,
        )  # fmt: skip

    lit = observed.lit_diffuse
    return shaded(lit) if "clipped-lamps" in s.without else shade_clipped(shaded, lit, surface.atlas)


def lit_room(surface: Surface, shading: Shading) -> LightField:
    """The room as a light source, with all that was found of its light."""
    lamps = [lamp.object_id for lamp in shading.lamps]
    room = LightField(surface.mesh, surface.atlas, surface.scene, shading.radiance, shading.environment, lamps)
    return room.with_mirrors(shading.mirrors).with_sun(shading.sun)


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
    rays: int = 128,
    emitter_rays: int = 32,
    portal_rays: int = 32,
    interpolate: bool = True,
    threads: int = 0,
    seed: int = 0,
    progress: Progress | None = None,
    find_mirrors: Callable[[LightField, tuple[Lamp, ...] | None], tuple[Mirror, ...]] | None = None,
    noise: float = 0.0,
    colours: dict[int, np.ndarray] | None = None,
    without: Collection[str] = (),
) -> Shading:
    """Lamps and irradiance (Haefner et al. 2021, sec. 3.2, with aimed rays and interpolation by default).

    Parameters
    ----------
    find_mirrors : callable, optional
        Tells the flat mirrors, as light is followed over them: with None for the lamps before those are known, and
        again with them.
    noise : float
        Metres, what was taken out of the mesh's vertices.
    colours : dict of (3,) float, optional
        Colour of light of objects that were clipped (`fringes`).
    without : collection of str
        Passes left out.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    class_of = {i.object_id: i.class_name for i in instances}
    seen = lit_diffuse.seen
    objects = int(atlas.object_id.max()) + 1
    surface = np.bincount(atlas.object_id, atlas.area, objects)
    seen_surface = np.bincount(atlas.object_id, atlas.area * seen, objects)
    seen_share = {i: float(seen_surface[i] / surface[i]) for i in np.unique(atlas.object_id) if surface[i] > 0}
    finest = finest_spacing(atlas)
    how = {"sampler": sampler, "threads": threads, "seed": seed, "smooth": "lamp-noise" not in without}
    emitter_rays = 0 if "emitter-rays" in without else emitter_rays
    portal_rays = 0 if "portal-rays" in without else portal_rays
    interpolate = interpolate and "interpolation" not in without
    find_mirrors = None if "mirrors" in without else find_mirrors
    colours = None if "fringe-colours" in without else colours

    # 1. All light. What nobody saw is dark at first, so that a lamp among it is missed and can be solved for.
    environment, sun = (environment, None) if "seen-sun" in without else taken_out(environment)
    field = LightField(mesh, atlas, scene, fill_unseen(lit_diffuse.radiance, seen), environment).with_sun(sun)
    good = seen & (((lit_diffuse.tier == CLEAN) & (lit_diffuse.count >= ENOUGH)) | (lit_diffuse.tier == SATURATED))
    unseen = [object_id for object_id, share in seen_share.items() if share == 0 and "unseen-lamps" not in without]
    single, sheet = fronts(mesh)
    tilted = tilt(single, 0.0 if "tilt-error" in without else noise)[sheet[atlas.triangle]]
    # Mirrors first: what hangs opposite or over one gets light over it, which lamps would have to answer for.
    field = field.with_mirrors(find_mirrors(field, None) if find_mirrors else ())
    good = good if good.any() else seen
    light, sun = find_all_light(field, good, unseen, instances, seed, tilted, colours, without=without)
    field = field.with_mirrors(()).with_sun(sun)
    notes = light.notes if sun is None else (*light.notes, sun.note)
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
    if len(dark) and "unseen-surfaces" in without:
        dark = dark[:0]
    if len(dark):
        rough = how | {"sampler": "aimed", "rays": 64, "emitter_rays": 4, "portal_rays": 8}
        rough |= {"interpolate": True, "finest": 8 * finest}
        coarse_lit, _, _, _ = irradiance(field, lit, **rough)
        coarse_dark, escaped_dark, _, _ = irradiance(field, dark, **rough)
        everywhere = np.zeros((len(atlas), 3), np.float32)
        everywhere[lit], everywhere[dark] = coarse_lit, coarse_dark
        rho, valid = quotient(lit_diffuse.radiance, everywhere)
        guess = fill(atlas, rho, valid, class_of, emitters)
        radiance[dark] = guess.rho[dark] * everywhere[dark] / np.float32(np.pi)
        seen_as = evened(field)[dark]
        field = field.with_light(radiance)
        # Inside a shade light goes to and fro.
        for _ in range(0 if "shades" in without else BOUNCES - 1):
            shades = strongly_lit(atlas, dark, radiance[dark], seen_as)
            if not shades:
                break
            radiance = field.radiance.copy()
            for own in shades:
                everywhere[own] = irradiance(field, own, **(rough | {"finest": finest}))[0]
                rho, valid = quotient(lit_diffuse.radiance[own], everywhere[own])
                told = valid & seen[own]
                paint = np.clip(np.median(rho[told], 0), 0, MAX_ALBEDO) if told.any() else guess.rho[own]
                radiance[own] = np.where(seen[own, None], radiance[own], paint * everywhere[own] / np.float32(np.pi))
            field = field.with_light(radiance)
        coarse_dark = everywhere[dark]

    # 3. The real thing, where there is an L_d to divide; elsewhere the rough values do.
    E = np.zeros((len(atlas), 3), np.float32)
    escaped, unsure = np.zeros(len(atlas), np.float32), np.zeros(len(atlas), np.float32)
    if len(dark):
        E[dark], escaped[dark] = coarse_dark, escaped_dark
    E[lit], escaped[lit], points, unsure[lit] = irradiance(
        field, lit, rays=rays, emitter_rays=emitter_rays, portal_rays=portal_rays,
        interpolate=interpolate, finest=finest, progress=progress, **how,
    )  # fmt: skip
    # A noisy mesh faces elsewhere than the surface did.
    unsure = np.hypot(unsure, tilted)
    if (
        sampler != "uniform" and "crease-error" not in without
    ):  # the paper's way, whose rays alone leave more noise than creases do
        # Near a crease the light of two sides is mixed.
        unsure = np.hypot(unsure, crease_doubt(mesh, atlas, atlas.texel_edge))
    return Shading(E, escaped, unsure, field.radiance, lamps, light.environment, notes, mirrors, points, sun)


def to_store(found: Shading) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """What is stored of a `Shading`: arrays, and what JSON holds."""
    arrays = {name: getattr(found, name) for name in ("irradiance", "escaped", "doubt", "radiance")}
    arrays |= {"sky": found.environment.radiance, "sky_seen": found.environment.observations}
    meta = {
        "sun": found.sun and {k: np.asarray(v).tolist() for k, v in asdict(found.sun).items()},
        "points": found.points,
        "mirrors": [mirror.as_lists() for mirror in found.mirrors],
        "notes": list(found.notes),
        "lamps": [asdict(lamp) | {"radiance": lamp.radiance.tolist()} for lamp in found.lamps],
    }
    return arrays, meta


def from_store(a: dict[str, np.ndarray], meta: dict[str, Any]) -> Shading:
    """The inverse of `to_store`."""
    lamps = tuple(
        Lamp(**(d | {"radiance": np.float32(d["radiance"]), "spread": d["spread"] and tuple(d["spread"])}))
        for d in meta["lamps"]
    )
    mirrors = tuple(Mirror.from_lists(d) for d in meta["mirrors"])
    return Shading(
        a["irradiance"], a["escaped"], a["doubt"], a["radiance"], lamps,
        Environment(a["sky"], a["sky_seen"]), tuple(meta["notes"]), mirrors, meta["points"],
        meta["sun"] and Sun(**{k: np.float32(v) if isinstance(v, list) else v for k, v in meta["sun"].items()}),
    )  # fmt: skip
