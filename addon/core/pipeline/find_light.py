"""All light of a room: lamps and sky, a sun, and what a mesh without objects lacks of it."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..light.few_elements import barely_seen, filled_radiance, from_sun, irradiance_at, mostly_lit, spread_over
from ..light.field import LightField
from ..light.lamps import Lamp, LampKinds
from ..light.mirrors import Mirror
from ..light.openings import looked_out_by
from ..light.sun import Sun
from ..luminance import LUMINANCE
from ..passes.clipped_lamps.patches import measured_patches
from ..passes.missing_light.missing_light import MissingLight, find_missing_light
from ..passes.sun.clipped_sunlight import with_clipped_sunlight
from ..passes.sun.params import SUN
from ..passes.sun.sun_fit import find_sun
from ..passes.unseen_light.unseen_light import Light, find_light, lit_by
from ..scene.lit_diffuse import LitDiffuse
from ..scene.model import Camera
from ..scene.params import VISIBILITY
from ..scene.visibility import CLEAN, SATURATED
from ..significance import LEVELS
from ..weighted import weighted_median


@dataclass(frozen=True)
class Search:
    """What light is looked for in, and by what.

    Attributes
    ----------
    dark : LightField
        As the frames show it, without lamps; dark where no frame saw it.
    find_mirrors, shining, cameras, patches
        As in `shade`.
    whole : (n,) int
        The object of each element before `patches` were set apart.
    lower : (n, 3) bool
        Channels of L_d that are lower bounds.
    """

    dark: LightField
    lit_diffuse: LitDiffuse
    kinds: LampKinds
    find_mirrors: Callable[[LightField, tuple[Lamp, ...] | None], tuple[Mirror, ...]] | None
    seed: int
    shining: Mapping[int, np.ndarray]
    without: Collection[str]
    cameras: Sequence[Camera]
    patches: list[int] | None
    whole: np.ndarray
    lower: np.ndarray


def with_all_light(search: Search) -> tuple[LightField, Light, np.ndarray]:
    """The room with lamps, sky, sun and mirrors, and what was found of the first two.

    Last, the unseen elements whose radiance the light of a mesh without objects gives, (n,) bool.
    """
    dark, lit_diffuse, find_mirrors, without = search.dark, search.lit_diffuse, search.find_mirrors, search.without
    atlas, seen, tier = dark.atlas, lit_diffuse.seen, lit_diffuse.tier
    clean = seen & (tier == CLEAN)
    reliable = clean & (lit_diffuse.count >= VISIBILITY.enough)
    # One clean look at a lamp shows what it sends.
    good = reliable | seen & (tier == SATURATED)
    good |= clean & barely_seen(dark, good)
    good = good if good.any() else seen
    real = atlas.area > 0
    unseen = np.setdiff1d(atlas.object_id[real], atlas.object_id[real & seen]).tolist()
    unseen = [] if "unseen-lamps" in without else unseen
    # Mirrors first: what is opposite or over one gets light by it, which would otherwise be attributed to lamps.
    field = dark.with_mirrors(find_mirrors(dark, None) if find_mirrors else ())
    find = partial(
        find_light, good=good, unseen_objects=unseen, kinds=search.kinds, seed=search.seed,
        shining=search.shining, without=without,
    )  # fmt: skip
    light = find(field)

    def lit(light: Light, sun: Sun | None) -> LightField:
        field = dark.with_sun(sun)
        radiance = field.radiance.copy()
        for lamp in light.lamps:
            elements = atlas.elements_of(lamp.object_id)
            # At its edges the surroundings are mixed in.
            radiance[elements[tier[elements] != CLEAN] if lamp.seen else elements] = lamp.radiance
        field = field.with_light(radiance, light.environment, [lamp.object_id for lamp in light.lamps])
        return field.with_mirrors(find_mirrors(field, light.lamps) if find_mirrors else ())

    # A mesh whose parts were guessed may lack most of its light, and a sun can be told only once that is known.
    if search.patches is not None and "missing-light" not in without:
        found = with_missing_light(search, lit(light, dark.sun), light, reliable, search.patches)
        if found is not None:
            return found
    sun = dark.sun
    if sun is None and len(light.received) and "sun" not in without:
        light, dark = with_sun_found(search, light.without_mixed(field), light, find, good)
        sun = dark.sun
    return lit(light, sun), light, np.zeros(len(atlas), bool)


def with_sun_found(
    search: Search, unmixed: LightField, light: Light, find: Callable[..., Light], good: np.ndarray
) -> tuple[Light, LightField]:
    """A sun that no frame shows, and lamps and sky under it; without one `light` as it is, to the last bit.

    And the room as frames show it, with that sun and what it makes clipped surfaces send.

    Parameters
    ----------
    unmixed : LightField
        Without what the frames show of lamps and something else at once.
    find : callable
        `find_light` of a field, with all that is the same for each.
    good : (n,) bool
        As in `find_light`.
    """
    dark, seed, lower = search.dark, search.seed, search.lower
    object_id, lamps = unmixed.atlas.object_id, [lamp.object_id for lamp in light.lamps]
    lit_field = unmixed.with_light(lit_by(unmixed, list(light.lamps)), light.environment, lamps)
    unlit = ~np.isin(object_id, lamps)
    free, clipped = unlit[light.element], lower.any(1)
    sun_fit = find_sun(
        unmixed, light.element[free], light.received[free], good & unlit,
        lambda element: irradiance_at(lit_field, element, seed), object_id, lower, seed,
    )  # fmt: skip
    if sun_fit is None:
        return light, dark
    lit_by_sun, dark = unmixed.with_sun(sun_fit.sun), dark.with_sun(sun_fit.sun)
    sunlit = np.zeros(len(clipped), bool)
    if "clipped-sunlight" not in search.without:
        sent = with_clipped_sunlight(lit_by_sun, clipped & unlit, light.element[free], light.received[free], object_id)
        sunlit = (sent > lit_by_sun.radiance).any(1)
    if sunlit.any():
        light_with_sun = find(
            lit_by_sun.with_light(sent), before=light, good=good & ~sunlit, sunlit=sunlit, measured=sun_fit.measured
        )
        factor = light_with_sun.sun
        dark = dark.with_light(np.where(sunlit[:, None], sent * np.float32(factor), dark.radiance))
        return light_with_sun, dark.with_sun(sun_fit.times(factor))
    light_with_sun = find(lit_by_sun, before=light)
    if not len(light_with_sun.received):
        return light_with_sun, dark
    # Lamps and sky that stood in for the sun no longer do, so its strength is solved for again beside them.
    others = light_with_sun.received - from_sun(lit_by_sun, light.element)
    factor = np.maximum(others, 0) / np.maximum(light.received, 1e-12)
    return light_with_sun, dark.with_sun(sun_fit.under(factor[free]))


def with_missing_light(
    search: Search, field: LightField, light: Light, good: np.ndarray, patches: list[int]
) -> tuple[LightField, Light, np.ndarray] | None:
    """A room that lacks light with that of clipped patches and openings, and a sun's; None if nothing tells of any.

    Last, the unseen elements for which it gives the radiance they send ((n,) bool).

    Parameters
    ----------
    field : LightField
        With all `light` that was found otherwise.
    good : (n,) bool
        Elements whose L_d is to be believed.
    """
    dark, lit_diffuse, whole, seed = search.dark, search.lit_diffuse, search.whole, search.seed
    measured = measured_patches(patches, field.atlas, lit_diffuse)
    bright = np.isin(field.atlas.object_id, [*measured, *(mirror.object_id for mirror in field.mirrors)])
    reflecting = dark.with_mirrors(field.mirrors)
    unknown, reliable = [patch for patch in patches if patch not in measured], good & ~bright
    if reliable.sum() < LEVELS.many:
        return None
    median_luminance = weighted_median(dark.radiance[good] @ LUMINANCE, field.atlas.area[good])
    windows, directions = looked_out_by(
        search.cameras, field.scene, field.environment, median_luminance, *field.outer_box
    )
    # What is seen through a crack is near, and says nothing of what lies in that direction.
    reflecting = reflecting.with_light(reflecting.radiance, reflecting.environment.shown_in(directions))
    missing = find_missing_light(reflecting, reliable, unknown, seed, windows)
    if not missing.believed:
        return None
    lit_field, light_found = with_found_light(dark, field, light, lit_diffuse, missing, measured)
    if "sun" in search.without or dark.sun is not None:
        return lit_field, light_found, missing.shut
    element = spread_over(dark, np.flatnonzero(lit_diffuse.seen), SUN.even, np.random.default_rng([seed, 4]))
    irradiance_by_all = partial(irradiance_at, lit_field, seed=seed)
    received, clipped = irradiance_by_all(element), search.lower.any(1)
    solved = find_sun(dark, element, received, lit_diffuse.seen, irradiance_by_all, whole, search.lower, seed)
    if solved is None:
        return lit_field, light_found, missing.shut
    bound, sunlit, dark = dark.radiance, np.zeros(len(clipped), bool), dark.with_sun(solved.sun)
    # What is far brighter than the room because the sun lights it is no lamp.
    measured = [patch for patch in measured if not mostly_lit(dark, dark.atlas.object_id == patch)]
    if "clipped-sunlight" not in search.without:
        dark = dark.with_light(with_clipped_sunlight(dark, clipped, element, received, whole))
        sunlit = (dark.radiance > bound).any(1)
        unknown = np.setdiff1d(unknown, dark.atlas.object_id[sunlit]).tolist()
        reliable = reliable & ~clipped
    reflecting = reflecting.with_sun(dark.sun).with_light(dark.radiance)
    missing = find_missing_light(reflecting, reliable, unknown, seed, windows, sunlit)
    if sunlit.any():
        sent = np.maximum(dark.radiance * np.float32(missing.sun), bound)
        dark = dark.with_sun(solved.times(missing.sun)).with_light(np.where(sunlit[:, None], sent, dark.radiance))
    lit_field, light_found = with_found_light(dark, field, light, lit_diffuse, missing, measured)
    if not sunlit.any():
        under_others = irradiance_at(lit_field.with_sun(None), element, seed)
        lit_field = lit_field.with_sun(solved.under(under_others / np.maximum(received, 1e-12)))
    return lit_field, light_found, missing.shut


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
