"""The shading stage: from the lit diffuse texture to lamps, irradiance and albedo."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..light.environment import Environment
from ..light.few_elements import barely_seen, evened
from ..light.field import LightField
from ..light.lamps import Lamp, LampKinds, lamp_kinds
from ..light.mirrors import Mirror, known_mirror
from ..light.openings import Openings, looked_out_by
from ..light.over_surface import Gathering, finest_spacing, irradiance
from ..light.shading import Shading
from ..light.sun import Sun, taken_out
from ..luminance import LUMINANCE
from ..memory import give_back
from ..passes.clipped_lamps.clipped import shade_clipped
from ..passes.clipped_lamps.patches import clipped_patches, told_of
from ..passes.mirrors.flat_mirrors import find_mirrors
from ..passes.mirrors.mirror_patches import mirror_patches
from ..passes.missing_light.missing_light import MissingLight, find_missing_light, is_missing
from ..passes.sun.sun_patch import find_patch_sun
from ..passes.unseen_light.unseen_light import Light
from ..progress import Progress
from ..scene.atlas import Atlas
from ..scene.creases import crease_error
from ..scene.lit_diffuse import LitDiffuse
from ..scene.mesh_noise import tilt
from ..scene.model import Camera, Capture, Instance, Mesh
from ..scene.params import VISIBILITY
from ..scene.patches import Patches
from ..scene.surface import Surface
from ..scene.two_sides import fronts
from ..scene.visibility import CLEAN, SATURATED
from ..settings import Settings
from ..weighted import weighted_median
from .find_light import find_all_light
from .frames import STAGE as FRAMES
from .frames import Observed
from .published import light as published_light
from .stage import Stage
from .surface import STAGE as SURFACE
from .unseen_surfaces import with_unseen_by_light, with_unseen_surfaces

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

    lit = observed.lit_diffuse
    if "shading" in s.published:
        return published_light.shade(
            surface.mesh, surface.atlas, surface.scene, lit, observed.environment,
            rays=s.shading_rays, threads=s.threads, seed=s.seed, progress=progress,
        )  # fmt: skip
    patches, guessed = Patches.none(), capture.mesh.whole
    if guessed and not {"clipped-patches", "missing-light"} & set(s.without):
        patches = clipped_patches(surface.mesh, surface.atlas, surface.lookup, lit)
        surface = patches.surface(surface)
    if guessed and s.mirrors and "mirrors" not in s.without:
        seen = LightField(
            surface.mesh, surface.atlas, surface.scene, unseen_dark(lit), observed.environment, lookup=surface.lookup
        )
        glass = mirror_patches(seen, observed.samples)
        patches, surface = Patches.together([patches, glass]), glass.surface(surface)
    capture = patches.capture(capture)

    def shaded(lit: LitDiffuse, shining: Collection[int] = ()) -> Shading:
        return shade(
            surface, capture.instances, lit, observed.environment, s, progress=progress,
            find_mirrors=mirrors if s.mirrors else None, shining=shining,
            patches=patches.lamps if guessed else None, cameras=[frame.camera for frame in capture.frames],
        )  # fmt: skip

    if "clipped-lamps" in s.without:
        found = shaded(lit)
    else:
        found = shade_clipped(shaded, lit, surface.atlas, patches.lamps)
    return with_patches_of(found, patches)


def with_patches_of(found: Shading, patches: Patches) -> Shading:
    """Light that was found with `patches` set apart: those that are no lamps or mirrors are of their objects again."""
    mirrors = {one.object_id for one in found.mirrors}
    kept, number = patches.kept(set(patches.objects) & (found.emitters | mirrors))

    def told(found: Any) -> tuple:
        return tuple(replace(one, object_id=number.get(one.object_id, one.object_id)) for one in found)

    return replace(found, lamps=told(found.lamps), mirrors=told(found.mirrors), patches=kept)


def lit_room(surface: Surface, shading: Shading) -> LightField:
    """The room as a light source, with all that was found of its light."""
    lamps = [lamp.object_id for lamp in shading.lamps]
    room = LightField(
        surface.mesh, surface.atlas, surface.scene, shading.radiance, shading.environment, lamps, surface.lookup
    )
    return room.with_mirrors(shading.mirrors).with_sun(shading.sun).with_openings(shading.openings)


def unseen_dark(lit_diffuse: LitDiffuse) -> np.ndarray:
    """L_d with the unseen elements dark, as (n, 3) float32 without NaN."""
    return np.where(lit_diffuse.seen[:, None], lit_diffuse.radiance, np.float32(0)).astype(np.float32)


def shade(
    surface: Surface,
    instances: tuple[Instance, ...],
    lit_diffuse: LitDiffuse,
    environment: Environment,
    settings: Settings,
    *,
    progress: Progress | None = None,
    find_mirrors: Callable[[LightField, tuple[Lamp, ...] | None], tuple[Mirror, ...]] | None = None,
    shining: Collection[int] = (),
    patches: list[int] | None = None,
    cameras: Sequence[Camera] = (),
) -> Shading:
    """Lamps and irradiance by aimed rays, interpolated.

    Parameters
    ----------
    find_mirrors : callable, optional
        Tells the flat mirrors, as light is followed over them: with None for the lamps before those are known, and
        again with them.
    shining : collection of int
        Objects that frames show clipped, of which `lit_diffuse` holds nothing.
    patches : list of int, optional
        Objects that were set apart as they were clipped; None where the capture tells of its objects.
    cameras : sequence of Camera
        Of the frames.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    mesh, atlas, without, seed = surface.mesh, surface.atlas, settings.without, settings.seed
    how: Gathering = {
        "finest": finest_spacing(atlas),
        "smooth": "lamp-noise" not in without,
        "threads": settings.threads,
        "seed": seed,
    }
    find_mirrors = None if "mirrors" in without else find_mirrors
    tilted = np.zeros(len(atlas)) if "tilt-error" in without else turned_by_noise(mesh, atlas, surface.noise)

    environment, sun = (environment, None) if "seen-sun" in without else taken_out(environment)
    # What nobody saw is dark at first, so that a lamp among it is missed and can be solved for.
    dark = LightField(
        mesh, atlas, surface.scene, unseen_dark(lit_diffuse), environment, lookup=surface.lookup
    ).with_sun(sun)
    clean = lit_diffuse.seen & (lit_diffuse.tier == CLEAN)
    if "unseen-surfaces" not in without and clean.any():
        dark = with_unseen_by_light(dark, clean, **how)
    kinds = lamp_kinds(mesh, instances, surface.noise)
    field, light = with_all_light(dark, lit_diffuse, kinds, find_mirrors, seed, tilted, shining, without)
    solved = np.zeros(len(atlas), bool)
    if patches is not None and "missing-light" not in without:
        field, light, solved = with_missing_light(dark, field, light, lit_diffuse, patches, cameras, without, seed)
    del dark

    # Where there is no L_d to divide, the rough E does.
    emitters = {lamp.object_id for lamp in light.lamps}
    told = lit_diffuse.seen | solved | np.isin(atlas.object_id, list(emitters))
    if not told.all() and "unseen-surfaces" not in without:
        field, E, escaped = with_unseen_surfaces(field, told, lit_diffuse, instances, emitters, **how)
        give_back()
    else:
        E, escaped = np.zeros((len(atlas), 3), np.float32), np.zeros(len(atlas), np.float32)
    lit, unsure = np.flatnonzero(told), np.zeros(len(atlas), np.float32)
    E[lit], escaped[lit], points, unsure[lit] = irradiance(
        field, lit, rays=settings.shading_rays,
        emitter_rays=0 if "emitter-rays" in without else settings.emitter_rays,
        portal_rays=0 if "portal-rays" in without else settings.portal_rays,
        interpolate=settings.interpolate and "interpolation" not in without, progress=progress, **how,
    )  # fmt: skip
    # A noisy mesh faces elsewhere than the surface did.
    unsure = np.hypot(unsure, tilted)
    # Near a crease the light of two sides is mixed.
    if "crease-error" not in without:
        unsure = np.hypot(unsure, crease_error(mesh, atlas, atlas.texel_edge))
    notes = light.notes if field.sun is None else (*light.notes, field.sun.note)
    return Shading(
        E, escaped, unsure, field.radiance, light.lamps, field.environment, notes, field.mirrors, points, field.sun,
        field.openings,
    )  # fmt: skip


def turned_by_noise(mesh: Mesh, atlas: Atlas, noise: float) -> np.ndarray:
    """Radians by which `noise` metres in the vertices may have turned each element, (n,) float."""
    single, sheet = fronts(mesh)
    return tilt(single, noise)[sheet[atlas.triangle]]


def with_all_light(
    field: LightField,
    lit_diffuse: LitDiffuse,
    kinds: LampKinds,
    find_mirrors: Callable[[LightField, tuple[Lamp, ...] | None], tuple[Mirror, ...]] | None,
    seed: int,
    tilted: np.ndarray,
    shining: Collection[int],
    without: Collection[str],
) -> tuple[LightField, Light]:
    """The room with lamps, sky, sun and mirrors, and what was found of the first two.

    Parameters
    ----------
    field : LightField
        Dark where no frame saw it.
    tilted : (n,) float
        `turned_by_noise`.
    """
    atlas, seen, tier = field.atlas, lit_diffuse.seen, lit_diffuse.tier
    clean = seen & (tier == CLEAN)
    good = clean & (lit_diffuse.count >= VISIBILITY.enough) | seen & (tier == SATURATED)
    # One clean look at a lamp shows what it sends.
    good |= clean & barely_seen(field, good)
    real = atlas.area > 0
    unseen = np.setdiff1d(atlas.object_id[real], atlas.object_id[real & seen]).tolist()
    unseen = [] if "unseen-lamps" in without else unseen
    # Mirrors first: what hangs opposite or over one gets light over it, which lamps would have to answer for.
    field = field.with_mirrors(find_mirrors(field, None) if find_mirrors else ())
    good = good if good.any() else seen
    light, sun = find_all_light(field, good, unseen, kinds, seed, tilted, shining, without=without)
    field = field.with_mirrors(()).with_sun(sun)
    radiance = field.radiance.copy()
    for lamp in light.lamps:
        own = atlas.elements_of(lamp.object_id)
        # At its edges the surroundings are mixed in.
        radiance[own[tier[own] != CLEAN] if lamp.seen else own] = lamp.radiance
    field = field.with_light(radiance, light.environment, [lamp.object_id for lamp in light.lamps])
    return field.with_mirrors(find_mirrors(field, light.lamps) if find_mirrors else ()), light


def with_missing_light(
    dark: LightField,
    field: LightField,
    light: Light,
    lit_diffuse: LitDiffuse,
    patches: list[int],
    cameras: Sequence[Camera],
    without: Collection[str],
    seed: int,
) -> tuple[LightField, Light, np.ndarray]:
    """The room with the light of clipped patches and openings, if it lacks light; else as it is.

    Last, the elements that no frame saw of which it tells what they send ((n,) bool).

    Parameters
    ----------
    dark : LightField
        As the frames show it, without lamps, dark where no frame saw it.
    field : LightField
        With all `light` that was found otherwise.
    """
    good = (lit_diffuse.tier == CLEAN) & (lit_diffuse.count >= VISIBILITY.enough)
    if not is_missing(field, good, seed):
        return field, light, np.zeros(len(field.atlas), bool)
    told = told_of(patches, field.atlas, lit_diffuse)
    bright = np.isin(field.atlas.object_id, [*told, *(one.object_id for one in field.mirrors)])
    lit_over = dark.with_mirrors(field.mirrors)
    unknown, believed = [one for one in patches if one not in told], good & ~bright
    usual = weighted_median(dark.radiance[good] @ LUMINANCE, field.atlas.area[good])
    windows, looks = looked_out_by(cameras, field.scene, field.environment, usual, *field.outer_box)
    # What is seen through a crack is near, and says nothing of what lies in that direction.
    lit_over = lit_over.with_light(lit_over.radiance, lit_over.environment.shown_in(looks))
    found = find_missing_light(lit_over, believed, unknown, seed, windows)
    lit, now = with_found_light(dark, field, light, lit_diffuse, found, told)
    if "sun" in without or dark.sun is not None:
        return lit, now, found.shut
    sun = find_patch_sun(dark, lit, lit_diffuse, patches, seed)
    if sun is None:
        return lit, now, found.shut
    dark, lit_over = dark.with_sun(sun), lit_over.with_sun(sun)
    found = find_missing_light(lit_over, believed, unknown, seed, windows)
    return *with_found_light(dark, field, light, lit_diffuse, found, told), found.shut


def with_found_light(
    dark: LightField, field: LightField, light: Light, lit_diffuse: LitDiffuse, found: MissingLight, told: list[int]
) -> tuple[LightField, Light]:
    """The room with the light that was `found` to be missing; `told` are the patches whose radiance frames tell."""
    radiance = evened(dark)
    for one, solved in found.radiance.items():
        own = dark.atlas.object_id == one
        radiance[own] = np.maximum(radiance[own], solved)
    atlas, shut = dark.atlas, found.shut
    radiance[shut] = found.openings.radiance[found.openings.behind(atlas.position[shut], atlas.normal[shut])]
    # What looked like a lamp for want of light may do so no more.
    seen = tuple(lamp for lamp in light.lamps if lamp.seen and lamp.object_id in {*found.brighter, *told})
    for lamp in seen:
        own = dark.atlas.object_id == lamp.object_id
        radiance[own & (lit_diffuse.tier != CLEAN)] = lamp.radiance
    lamps = (*seen, *found.lamps)
    middle = np.median(dark.atlas.position, 0)
    # What is bright is written as lamps where it lies (`Openings.panels`).
    environment = found.openings.without_bright().filled(found.environment, middle)
    field = field.with_light(radiance, environment, [lamp.object_id for lamp in lamps])
    light = replace(light, lamps=lamps, environment=environment, notes=found.notes)
    return field.with_openings(found.openings).with_sun(dark.sun), light


def to_store(found: Shading) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """What is stored of a `Shading`: arrays, and what JSON holds."""
    arrays = {name: getattr(found, name) for name in ("irradiance", "escaped", "relative_error", "radiance")}
    arrays |= {"sky": found.environment.radiance, "sky_seen": found.environment.observations}
    if found.openings is not None:
        arrays |= {f"openings_{one.name}": getattr(found.openings, one.name) for one in fields(Openings)}
    arrays |= {f"patches_{one.name}": getattr(found.patches, one.name) for one in fields(Patches)}
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
        a["irradiance"], a["escaped"], a["relative_error"], a["radiance"], lamps,
        Environment(a["sky"], a["sky_seen"]), tuple(meta["notes"]), mirrors, meta["points"],
        None if meta["sun"] is None else _sun(**meta["sun"]),
        Openings(
            a["openings_low"], a["openings_size"], a["openings_radiance"], float(a["openings_share"]),
            a["openings_windows"],
        ) if "openings_low" in a else None,
        Patches(*(a[f"patches_{one.name}"] for one in fields(Patches))),
    )  # fmt: skip


def _sun(direction: list[float], irradiance: list[float], **more: Any) -> Sun:
    return Sun(np.array(direction, np.float32), np.array(irradiance, np.float32), **more)
