"""The shading stage: from the lit diffuse texture to lamps, irradiance and albedo."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..light.environment import Environment
from ..light.field import LightField
from ..light.lamps import Lamp, lamp_kinds
from ..light.mirrors import Mirror, known_mirror
from ..light.openings import Openings
from ..light.over_surface import Gathering, finest_spacing, irradiance
from ..light.shading import Shading
from ..light.sun import Sun, extract_sun
from ..memory import give_back
from ..passes.clipped_lamps.clipped import shade_clipped
from ..passes.clipped_lamps.patches import clipped_patches
from ..passes.material_parts.material_parts import seen_pieces, unlike_pieces
from ..passes.mirrors.flat_mirrors import find_mirrors
from ..passes.mirrors.mirror_patches import mirror_patches
from ..progress import Progress
from ..results.values import kinds_of
from ..scene.creases import crease_error
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Camera, Capture, Instance
from ..scene.patches import Patches
from ..scene.surface import Surface
from ..scene.visibility import CLEAN
from ..settings import Settings
from .find_light import Search, with_all_light
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
WHITE = np.ones(3)
SHADING = kinds_of(Shading, Lamp, Environment, Mirror, Sun, Openings, Patches)
"""What a stored `Shading` may hold."""


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
    patches, parts_guessed, whole = Patches(), capture.mesh.whole, surface.atlas.object_id
    cameras = [frame.camera for frame in capture.frames]
    set_apart = parts_guessed and not {"clipped-patches", "missing-light"} & set(s.without)
    if set_apart:
        patches = clipped_patches(surface.mesh, surface.atlas, surface.lookup, lit_diffuse)
        surface = patches.surface(surface)
    if parts_guessed and s.mirrors and "mirrors" not in s.without:
        field = field_over(surface, unseen_dark(lit_diffuse), observed.environment)
        panes = mirror_patches(field, observed.samples)
        patches, surface = Patches.together([patches, panes]), panes.surface(surface)
    if not parts_guessed and "material-parts" not in s.without:
        patches = seen_pieces(surface.mesh, surface.atlas, lit_diffuse.seen)
        surface = patches.surface(surface)
    capture = patches.capture(capture)

    def shaded(lit_diffuse: LitDiffuse, shining: Mapping[int, np.ndarray]) -> Shading:
        return shade(
            surface, capture.instances, lit_diffuse, observed.environment, s, progress=progress,
            find_mirrors=mirrors if s.mirrors else None, shining=shining,
            patches=patches.lamps if parts_guessed else None, whole=whole, cameras=cameras,
            clip_colour=observed.calibration.clip_colour,
        )  # fmt: skip

    if "clipped-lamps" in s.without:
        shading = shaded(lit_diffuse, {})
    else:
        # What else is clipped where patches were set apart is lit, as a sofa in the sun: solving for it is in vain.
        no_lamps = [instance.object_id for instance in capture.instances] if set_apart else []
        shading = shade_clipped(shaded, lit_diffuse, surface.atlas, no_lamps)
    sources = shading.emitters | {mirror.object_id for mirror in shading.mirrors}
    groups = unlike_pieces(patches, whole, surface.atlas, lit_diffuse, shading.irradiance, sources)
    return with_patches_of(shading, patches, groups)


def with_patches_of(shading: Shading, patches: Patches, groups: list[list[int]]) -> Shading:
    """A `Shading` found with `patches` set apart: those that are in no group go back to their objects."""
    chosen, number = patches.grouped(groups)

    def renumbered(sources: Any) -> tuple:
        return tuple(replace(source, object_id=number.get(source.object_id, source.object_id)) for source in sources)

    return replace(shading, lamps=renumbered(shading.lamps), mirrors=renumbered(shading.mirrors), patches=chosen)


def field_over(
    surface: Surface, radiance: np.ndarray, environment: Environment, lamps: Collection[int] = ()
) -> LightField:
    """The light field over a surface."""
    return LightField(surface.mesh, surface.atlas, surface.scene, radiance, environment, lamps, surface.lookup)


def lit_room(surface: Surface, shading: Shading) -> LightField:
    """The room as a light source, with all that was found of its light."""
    lamps = [lamp.object_id for lamp in shading.lamps]
    room = field_over(surface, shading.radiance, shading.environment, lamps)
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
    shining: Mapping[int, np.ndarray] = MappingProxyType({}),
    patches: list[int] | None = None,
    whole: np.ndarray | None = None,
    cameras: Sequence[Camera] = (),
    clip_colour: np.ndarray = WHITE,
) -> Shading:
    """Lamps and irradiance by aimed rays, interpolated.

    Parameters
    ----------
    find_mirrors : callable, optional
        Finds the flat mirrors, as light is followed over them: with None for the lamps before those are known, and
        again with them.
    shining : mapping of int to (3,) float64
        Objects that frames show clipped, of which `lit_diffuse` holds nothing, and the radiance that they clip at.
    patches : list of int, optional
        Objects that were set apart as they were clipped; None where the capture names its objects.
    whole : (n,) int, optional
        The object of each element before any were set apart.
    cameras : sequence of Camera
        Of the frames.
    clip_colour : (3,) float64
        At which they clip.

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

    environment, sun = (environment, None) if "seen-sun" in without else extract_sun(environment)
    # What nobody saw is dark at first, so that a lamp among it is missed and can be solved for.
    dark = field_over(surface, unseen_dark(lit_diffuse), environment).with_sun(sun)
    clean = lit_diffuse.seen & (lit_diffuse.tier == CLEAN)
    if "unseen-surfaces" not in without and clean.any():
        dark = with_unseen_by_light(dark, clean, **gathering)
    kinds = lamp_kinds(mesh, instances, surface.noise)
    field, light, solved = with_all_light(Search(
        dark, lit_diffuse, kinds, find_mirrors, seed, shining, without, cameras, patches,
        atlas.object_id if whole is None else whole, lit_diffuse.lower_bounds(clip_colour),
    ))  # fmt: skip
    del dark
    field = field.with_unseen(None)  # the search for lamps alone asked for it

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
    # Near a crease the light of two sides is mixed.
    if "crease-error" not in without:
        error = np.hypot(error, crease_error(mesh, atlas, atlas.texel_edge))
    return Shading(
        E, escaped, error, field.radiance, light.lamps, field.environment, light.notes, field.mirrors, points,
        field.sun, field.openings,
    )  # fmt: skip
