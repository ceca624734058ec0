"""The shading stage: from the lit diffuse texture to lamps, irradiance and albedo."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..light.environment import Environment
from ..light.few_elements import barely_seen, filled_radiance, irradiance_at, spread_over
from ..light.field import LightField
from ..light.lamps import Lamp, LampKinds, lamp_kinds
from ..light.mirrors import Mirror, known_mirror
from ..light.openings import Openings, looked_out_by
from ..light.over_surface import Gathering, finest_spacing, irradiance
from ..light.shading import Shading
from ..light.sun import Sun, extract_sun
from ..luminance import LUMINANCE
from ..memory import give_back
from ..passes.clipped_lamps.clipped import shade_clipped
from ..passes.clipped_lamps.patches import clipped_patches, measured_patches
from ..passes.mirrors.flat_mirrors import find_mirrors
from ..passes.mirrors.mirror_patches import mirror_patches
from ..passes.missing_light.missing_light import MissingLight, find_missing_light, is_missing
from ..passes.sun.params import SUN
from ..passes.sun.sun_fit import find_sun
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
        mirrors_found = find_mirrors(field, lamps or (), observed.samples, capture.instances, s.seed)
        known = [known_mirror(mirror, field.mesh) for mirror in capture.mirrors]
        ids = {mirror.object_id for mirror in mirrors_found}
        return (*mirrors_found, *(mirror for mirror in known if mirror.object_id not in ids))

    lit_diffuse = observed.lit_diffuse
    if "shading" in s.published:
        return published_light.shade(
            surface.mesh, surface.atlas, surface.scene, lit_diffuse, observed.environment,
            rays=s.shading_rays, threads=s.threads, seed=s.seed, progress=progress,
        )  # fmt: skip
    patches, parts_guessed, whole = Patches.none(), capture.mesh.whole, surface.atlas.object_id
    cameras = [frame.camera for frame in capture.frames]
    if parts_guessed and not {"clipped-patches", "missing-light"} & set(s.without):
        patches = clipped_patches(surface.mesh, surface.atlas, surface.lookup, lit_diffuse)
        surface = patches.surface(surface)
    if parts_guessed and s.mirrors and "mirrors" not in s.without:
        field = LightField(
            surface.mesh,
            surface.atlas,
            surface.scene,
            unseen_dark(lit_diffuse),
            observed.environment,
            lookup=surface.lookup,
        )
        panes = mirror_patches(field, observed.samples)
        patches, surface = Patches.together([patches, panes]), panes.surface(surface)
    capture = patches.capture(capture)

    def shaded(lit_diffuse: LitDiffuse, shining: Collection[int] = ()) -> Shading:
        return shade(
            surface, capture.instances, lit_diffuse, observed.environment, s, progress=progress,
            find_mirrors=mirrors if s.mirrors else None, shining=shining,
            patches=patches.lamps if parts_guessed else None, whole=whole, cameras=cameras,
        )  # fmt: skip

    if "clipped-lamps" in s.without:
        shading = shaded(lit_diffuse)
    else:
        shading = shade_clipped(shaded, lit_diffuse, surface.atlas, patches.lamps)
    return with_patches_of(shading, patches)


def with_patches_of(shading: Shading, patches: Patches) -> Shading:
    """A `Shading` found with `patches` set apart: those that are no lamps or mirrors go back to their objects."""
    mirrors = {mirror.object_id for mirror in shading.mirrors}
    chosen, number = patches.subset(set(patches.objects) & (shading.emitters | mirrors))

    def renumbered(sources: Any) -> tuple:
        return tuple(replace(source, object_id=number.get(source.object_id, source.object_id)) for source in sources)

    return replace(shading, lamps=renumbered(shading.lamps), mirrors=renumbered(shading.mirrors), patches=chosen)


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
    whole: np.ndarray | None = None,
    cameras: Sequence[Camera] = (),
) -> Shading:
    """Lamps and irradiance by aimed rays, interpolated.

    Parameters
    ----------
    find_mirrors : callable, optional
        Finds the flat mirrors, as light is followed over them: with None for the lamps before those are known, and
        again with them.
    shining : collection of int
        Objects that frames show clipped, of which `lit_diffuse` holds nothing.
    patches : list of int, optional
        Objects that were set apart as they were clipped; None where the capture names its objects.
    whole : (n,) int, optional
        The object of each element before any were set apart.
    cameras : sequence of Camera
        Of the frames.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    mesh, atlas, without, seed = surface.mesh, surface.atlas, settings.without, settings.seed
    gathering: Gathering = {
        "finest": finest_spacing(atlas),
        "smooth": "lamp-noise" not in without,
        "threads": settings.threads,
        "seed": seed,
    }
    find_mirrors = None if "mirrors" in without else find_mirrors
    tilted = np.zeros(len(atlas)) if "tilt-error" in without else turned_by_noise(mesh, atlas, surface.noise)

    environment, sun = (environment, None) if "seen-sun" in without else extract_sun(environment)
    # What nobody saw is dark at first, so that a lamp among it is missed and can be solved for.
    dark = LightField(
        mesh, atlas, surface.scene, unseen_dark(lit_diffuse), environment, lookup=surface.lookup
    ).with_sun(sun)
    clean = lit_diffuse.seen & (lit_diffuse.tier == CLEAN)
    if "unseen-surfaces" not in without and clean.any():
        dark = with_unseen_by_light(dark, clean, **gathering)
    kinds = lamp_kinds(mesh, instances, surface.noise)
    reliable = clean & (lit_diffuse.count >= VISIBILITY.enough)
    # A mesh whose parts were guessed may lack most of its light.
    lacks_light = (
        None if patches is None or "missing-light" in without else partial(is_missing, good=reliable, seed=seed)
    )
    field, light, missing = with_all_light(
        dark, lit_diffuse, kinds, find_mirrors, seed, tilted, shining, without, lacks_light
    )
    solved = np.zeros(len(atlas), bool)
    if missing and patches is not None:
        whole = atlas.object_id if whole is None else whole
        field, light, solved = with_missing_light(
            dark, field, light, lit_diffuse, reliable, patches, whole, cameras, without, seed
        )
    del dark

    # Where there is no L_d to divide, the rough E does.
    emitters = {lamp.object_id for lamp in light.lamps}
    known = lit_diffuse.seen | solved | np.isin(atlas.object_id, list(emitters))
    if not known.all() and "unseen-surfaces" not in without:
        field, E, escaped = with_unseen_surfaces(field, known, lit_diffuse, instances, emitters, **gathering)
        give_back()
    else:
        E, escaped = np.zeros((len(atlas), 3), np.float32), np.zeros(len(atlas), np.float32)
    indices, error = np.flatnonzero(known), np.zeros(len(atlas), np.float32)
    E[indices], escaped[indices], points, error[indices] = irradiance(
        field, indices, rays=settings.shading_rays,
        emitter_rays=0 if "emitter-rays" in without else settings.emitter_rays,
        portal_rays=0 if "portal-rays" in without else settings.portal_rays,
        interpolate=settings.interpolate and "interpolation" not in without, progress=progress, **gathering,
    )  # fmt: skip
    # A noisy mesh faces elsewhere than the surface did.
    error = np.hypot(error, tilted)
    # Near a crease the light of two sides is mixed.
    if "crease-error" not in without:
        error = np.hypot(error, crease_error(mesh, atlas, atlas.texel_edge))
    notes = light.notes if field.sun is None else (*light.notes, field.sun.note)
    return Shading(
        E, escaped, error, field.radiance, light.lamps, field.environment, notes, field.mirrors, points, field.sun,
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
    lacks_light: Callable[[LightField], bool] | None = None,
) -> tuple[LightField, Light, bool]:
    """The room with lamps, sky, sun and mirrors, what was found of the first two, and whether it lacks light still.

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
    # Mirrors first: what is opposite or over one gets light by it, which would otherwise be attributed to lamps.
    field = field.with_mirrors(find_mirrors(field, None) if find_mirrors else ())
    good = good if good.any() else seen
    clipped = lit_diffuse.clipped > 0.5
    light, sun, missing = find_all_light(
        field, good, unseen, kinds, clipped, seed, tilted, shining, without, lacks_light
    )
    field = field.with_mirrors(()).with_sun(sun)
    radiance = field.radiance.copy()
    for lamp in light.lamps:
        elements = atlas.elements_of(lamp.object_id)
        # At its edges the surroundings are mixed in.
        radiance[elements[tier[elements] != CLEAN] if lamp.seen else elements] = lamp.radiance
    field = field.with_light(radiance, light.environment, [lamp.object_id for lamp in light.lamps])
    return field.with_mirrors(find_mirrors(field, light.lamps) if find_mirrors else ()), light, missing


def with_missing_light(
    dark: LightField,
    field: LightField,
    light: Light,
    lit_diffuse: LitDiffuse,
    good: np.ndarray,
    patches: list[int],
    whole: np.ndarray,
    cameras: Sequence[Camera],
    without: Collection[str],
    seed: int,
) -> tuple[LightField, Light, np.ndarray]:
    """A room that lacks light with that of clipped patches and openings, and a sun's.

    Last, the unseen elements for which it gives the radiance they send ((n,) bool).

    Parameters
    ----------
    dark : LightField
        As the frames show it, without lamps, dark where no frame saw it.
    field : LightField
        With all `light` that was found otherwise.
    good : (n,) bool
        Elements whose L_d is to be believed.
    whole : (n,) int
        The object of each element before `patches` were set apart.
    """
    measured = measured_patches(patches, field.atlas, lit_diffuse)
    bright = np.isin(field.atlas.object_id, [*measured, *(mirror.object_id for mirror in field.mirrors)])
    reflecting = dark.with_mirrors(field.mirrors)
    unknown, reliable = [patch for patch in patches if patch not in measured], good & ~bright
    median_luminance = weighted_median(dark.radiance[good] @ LUMINANCE, field.atlas.area[good])
    windows, directions = looked_out_by(cameras, field.scene, field.environment, median_luminance, *field.outer_box)
    # What is seen through a crack is near, and says nothing of what lies in that direction.
    reflecting = reflecting.with_light(reflecting.radiance, reflecting.environment.shown_in(directions))
    missing = find_missing_light(reflecting, reliable, unknown, seed, windows)
    lit_field, light_found = with_found_light(dark, field, light, lit_diffuse, missing, measured)
    if "sun" in without or dark.sun is not None:
        return lit_field, light_found, missing.shut
    element = spread_over(dark, np.flatnonzero(lit_diffuse.seen), SUN.even, np.random.default_rng([seed, 4]))
    irradiance_by_all = partial(irradiance_at, lit_field, seed=seed)
    solved = find_sun(
        dark, element, irradiance_by_all(element), lit_diffuse.seen, irradiance_by_all, whole,
        lit_diffuse.clipped > 0.5, seed,
    )  # fmt: skip
    if solved is None:
        return lit_field, light_found, missing.shut
    dark, reflecting = dark.with_sun(solved.sun), reflecting.with_sun(solved.sun)
    missing = find_missing_light(reflecting, reliable, unknown, seed, windows)
    return *with_found_light(dark, field, light, lit_diffuse, missing, measured), missing.shut


def with_found_light(
    dark: LightField,
    field: LightField,
    light: Light,
    lit_diffuse: LitDiffuse,
    missing: MissingLight,
    measured: list[int],
) -> tuple[LightField, Light]:
    """The room with the light found `missing`; `measured` are the patches whose radiance the frames show."""
    radiance = filled_radiance(dark)
    for object_id, solved in missing.radiance.items():
        of_object = dark.atlas.object_id == object_id
        radiance[of_object] = np.maximum(radiance[of_object], solved)
    atlas, closed = dark.atlas, missing.shut
    radiance[closed] = missing.openings.radiance[missing.openings.behind(atlas.position[closed], atlas.normal[closed])]
    # What looked like a lamp for want of light may do so no more.
    seen_lamps = tuple(lamp for lamp in light.lamps if lamp.seen and lamp.object_id in {*missing.brighter, *measured})
    for lamp in seen_lamps:
        of_object = dark.atlas.object_id == lamp.object_id
        radiance[of_object & (lit_diffuse.tier != CLEAN)] = lamp.radiance
    lamps = (*seen_lamps, *missing.lamps)
    middle = np.median(dark.atlas.position, 0)
    # What is bright is written as lamps where it lies (`Openings.panels`).
    environment = missing.openings.without_bright().filled(missing.environment, middle)
    field = field.with_light(radiance, environment, [lamp.object_id for lamp in lamps])
    light = replace(light, lamps=lamps, environment=environment, notes=missing.notes)
    return field.with_openings(missing.openings).with_sun(dark.sun), light


def to_store(shading: Shading) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """What is stored of a `Shading`: arrays, and what JSON holds."""
    arrays = {name: getattr(shading, name) for name in ("irradiance", "escaped", "relative_error", "radiance")}
    arrays |= {"sky": shading.environment.radiance, "sky_seen": shading.environment.observations}
    if shading.openings is not None:
        arrays |= {f"openings_{field.name}": getattr(shading.openings, field.name) for field in fields(Openings)}
    arrays |= {f"patches_{field.name}": getattr(shading.patches, field.name) for field in fields(Patches)}
    meta = {
        "sun": shading.sun and {k: np.asarray(v).tolist() for k, v in asdict(shading.sun).items()},
        "points": shading.points,
        "mirrors": [mirror.as_lists() for mirror in shading.mirrors],
        "notes": list(shading.notes),
        "lamps": [asdict(lamp) | {"radiance": lamp.radiance.tolist()} for lamp in shading.lamps],
    }
    return arrays, meta


def from_store(arrays: dict[str, np.ndarray], meta: dict[str, Any]) -> Shading:
    """The inverse of `to_store`."""
    lamps = tuple(
        Lamp(
            **(
                entry
                | {"radiance": np.float32(entry["radiance"]), "spread": entry["spread"] and tuple(entry["spread"])}
            )
        )
        for entry in meta["lamps"]
    )
    mirrors = tuple(Mirror.from_lists(entry) for entry in meta["mirrors"])
    return Shading(
        arrays["irradiance"], arrays["escaped"], arrays["relative_error"], arrays["radiance"], lamps,
        Environment(arrays["sky"], arrays["sky_seen"]), tuple(meta["notes"]), mirrors, meta["points"],
        None if meta["sun"] is None else _sun(**meta["sun"]),
        Openings(
            arrays["openings_low"], arrays["openings_size"], arrays["openings_radiance"],
            float(arrays["openings_share"]), arrays["openings_windows"],
        ) if "openings_low" in arrays else None,
        Patches(*(arrays[f"patches_{field.name}"] for field in fields(Patches))),
    )  # fmt: skip


def _sun(direction: list[float], irradiance: list[float], **options: Any) -> Sun:
    return Sun(np.array(direction, np.float32), np.array(irradiance, np.float32), **options)
