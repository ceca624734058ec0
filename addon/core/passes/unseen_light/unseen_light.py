"""Light that no frame looked at, solved for from what it throws onto the surfaces that the frames do see.

A lamp behind the camera, or the sky above what the windows showed, still lights the room. Albedo varies little within
an object, light a lot: the radiance under which albedo varies least is the one taken (`light_fit`). Lamps are found one
by one.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from ...light.contributions import contributions, reaching_most
from ...light.environment import Environment
from ...light.few_elements import (
    barely_seen,
    by_sun,
    filled_radiance,
    from_sun,
    irradiance_at,
    most_reflected,
    pick,
    steady,
)
from ...light.field import LightField
from ...light.lamps import Lamp, LampKinds, find_seen, mixed_lamps, of_shining_class
from ...light.light_fit import Sample, on_flat
from ...light.params import LIGHT_FIT
from ...luminance import LUMINANCE
from ...significance import LEVELS
from .params import UNSEEN
from .sky import Sky, all_light
from .unseen_lamps import needed, solve_lamps, solve_sky, solve_together
from .whole_sky import with_whole_sky


@dataclass(frozen=True)
class Contributions:
    """E at the sample, without any sun, as it took its rays to find: what a second solution needs no rays for.

    Attributes
    ----------
    received : (m, 3) float64
        From what the frames saw.
    sky : list of (m,) float64
        From each part of the sky at radiance 1.
    element : (k,) int
        Those of the sample that tell of lamps.
    lamps : dict of (k,) float64
        E there at radiance 1 from each unseen object, and from those of its model (`LampKinds`).
    min_luminance : dict of float
        Luminance below which each would be no lamp.
    """

    received: np.ndarray
    sky: list[np.ndarray]
    element: np.ndarray
    lamps: dict[int, np.ndarray]
    min_luminance: dict[int, float]


@dataclass(frozen=True)
class Light:
    """All light of the room, as far as it can be known.

    Attributes
    ----------
    environment : Environment
        With the unseen parts of the sky solved for where they could be.
    notes : tuple of str
        What was solved, one sentence each.
    element : (m,) int
        Those that it was solved at.
    received : (m, 3) float64
        E there by all of this light.
    mixed : tuple of int
        Lamps that frames show, but mixed with what is beside them (`mixed_lamps`): solved for as if unseen.
    sun : (3,) float64
        Times the irradiance of the field's sun: the light that it throws asks for that.
    """

    lamps: tuple[Lamp, ...]
    environment: Environment
    notes: tuple[str, ...]
    element: np.ndarray
    received: np.ndarray
    contribution: Contributions | None = None
    mixed: tuple[int, ...] = ()
    sun: np.ndarray = field(default_factory=lambda: np.ones(3))

    def without_mixed(self, field: LightField) -> LightField:
        """The field with lamps dark that frames show only mixed."""
        mixed = np.isin(field.atlas.object_id, self.mixed)[:, None]
        return field.with_light(np.where(mixed, np.float32(0), field.radiance)) if self.mixed else field


def find_light(
    field: LightField,
    good: np.ndarray,
    unseen_objects: list[int],
    kinds: LampKinds,
    seed: int = 0,
    shining: Mapping[int, np.ndarray] = MappingProxyType({}),
    before: Light | None = None,
    without: Collection[str] = (),
    sunlit: np.ndarray | None = None,
    measured: np.ndarray | None = None,
) -> Light:
    """Lamps seen and unseen, and the sky.

    Parameters
    ----------
    field : LightField
        With L_d filled in; what nobody saw must be dark in it, or it would hide the light looked for. With its
        mirrors, as far as they are known.
    good : (n,) bool
        Elements whose L_d rests on enough clean observations, saturated ones included.
    unseen_objects : list of int
        Objects of which no frame saw anything.
    shining : mapping of int to (3,) float64
        Of the unseen objects, those that surely are lamps, and the radiance that each has at least.
    before : Light, optional
        What was found in the same room without its sun, or of its mixed lamps.
    sunlit : (n,) bool, optional
        Elements that send more than frames show, as the field's sun is on them. That is solved for with all the rest.
    measured : (3,) bool, optional
        Channels of the sun that are known all the same.
    """
    measured = np.zeros(3, bool) if measured is None else measured
    sunlit = np.zeros(len(field.atlas), bool) if sunlit is None else sunlit
    original, mixed = field, before.mixed if before is not None else ()
    if before is not None:
        field, unseen_objects = before.without_mixed(field), [*unseen_objects, *mixed]
    flat = on_flat(field.atlas)
    usable = steady(field, good, flat) | barely_seen(field, good)
    # What a mirror shows is no albedo.
    usable &= ~np.isin(field.atlas.object_id, [mirror.object_id for mirror in field.mirrors])
    element = pick(field, usable, seed, LEVELS.sample)
    if not len(element):
        return Light((), field.environment, (), element, np.zeros((0, 3)), mixed=mixed)
    previous = before.contribution if before is not None and field.environment.seen and not sunlit.any() else None
    field, sky_notes = (field, ()) if "whole-sky" in without else with_whole_sky(field, element, seed)
    environment, atlas = field.environment, field.atlas
    solve_zones = environment.seen and "unseen-sky" not in without
    zones = environment.unknown_zones() if solve_zones else []
    known = environment
    for zone in zones:
        known = known.with_zone(zone, np.zeros(3, np.float32))
    dark, room_radiance, unlit = np.zeros_like(field.radiance), filled_radiance(field), field.with_sun(None)
    in_shade = np.where(sunlit[:, None], np.float32(0), room_radiance)
    lights = [unlit.with_light(in_shade, known)]
    lights += [unlit.with_light(dark, Environment.only(zone.pattern)) for zone in zones]
    if previous:
        sunless, sky_contributions = previous.received.copy(), [G.copy() for G in previous.sky]
    else:
        sunless, *by_sky = (irradiance_at(light, element, seed) for light in lights)
        sky_contributions = [G[:, 0] for G in by_sky]
    by_factor = by_sun(field, room_radiance, sunlit, element, seed, LIGHT_FIT.more_rays)
    sunlight = by_factor.sum(1) if sunlit.any() else from_sun(field, element)
    guess = [environment.zone_mean(zone).astype(np.float64) for zone in zones]
    filled = sunless + sunlight + sum(G[:, None] * s for G, s in zip(sky_contributions, guess, strict=True))
    seen = bright_all_over(field, element, filled)
    if before is None and "unseen-lamps" not in without:
        mixed = tuple(mixed_lamps(seen, atlas.object_id[good]))
        if mixed:
            mixed_light = Light((), original.environment, (), element, filled, mixed=mixed)
            return find_light(original, good, unseen_objects, kinds, seed, shining, mixed_light, without)
    lit = ~np.isin(atlas.object_id[element], [lamp.object_id for lamp in seen])
    if (lit & flat[element]).sum() >= LEVELS.many:
        lit &= flat[element]
    if lit.sum() < LEVELS.enough:
        return Light(tuple(seen), environment, sky_notes, element, filled, mixed=mixed)
    tells = element[lit]
    earlier = previous if previous is not None and np.array_equal(previous.element, tells) else None
    if earlier is None and (unseen_objects or zones):
        sunless[lit] = irradiance_at(lights[0], tells, seed, LIGHT_FIT.more_rays)
        for G, light in zip(sky_contributions, lights[1:], strict=True):
            G[lit] = irradiance_at(light, tells, seed, LIGHT_FIT.more_rays)[:, 0]
    received = (sunless + sunlight)[lit]
    sky = Sky([G[lit] for G in sky_contributions], guess, [z.clipped for z in zones], [z.measured for z in zones])
    sent = field.radiance[tells].astype(np.float64)
    sample = Sample(tells, atlas.object_id[tells], sent, all_light(received, [], {}, sky))
    # The same lamp hung several times is one unknown.
    kin = of_shining_class(seen, atlas.object_id[good], kinds)
    groups: dict[int, list[int]] = {}
    for object_id in unseen_objects:
        groups.setdefault(kinds.model.get(object_id, object_id), []).append(object_id)
    groups = {group[0]: group for group in groups.values()}
    if len(groups) > LEVELS.most:
        of_class = [i for i in groups if i in kin]
        others = [i for i in groups if i not in kin]
        best = reaching_most(field, sample.element, [groups[i] for i in others], LEVELS.most, seed)
        groups = {i: groups[i] for i in [*of_class, *(others[k] for k in best)][: LEVELS.most]}
    if earlier is not None:
        contribution, min_luminance = earlier.lamps, earlier.min_luminance
    else:
        more = LIGHT_FIT.more_rays if shining else 1
        by_group = contributions(field, sample.element, list(groups.values()), seed, more)
        contribution = dict(zip(groups, by_group.T, strict=True))
        # What it could reflect of the light that reaches it is no reason to call an unseen object a lamp.
        lit_room = field.with_light(room_radiance, environment)
        min_luminance = {i: most_reflected(lit_room, group, seed) for i, group in groups.items()}

    certain = {
        i: np.median([shining[k] for k in group if k in shining], 0)
        for i, group in groups.items()
        if not set(group).isdisjoint(shining)
    }
    for _ in range(UNSEEN.sweeps if zones else 1):
        lamps = solve_lamps(sample, contribution, min_luminance, kinds, kin, seen, sky, received)
        solve_sky(sample, lamps, contribution, sky, received)
    lamps, sky = needed(sample, lamps, contribution, sky, received, certain)
    sun = np.ones(3)
    if "plausible-light" not in without and (certain or any(sky.clipped) or sunlit.any()):
        lamps, sun = solve_together(
            sample, atlas, lamps, contribution, sky, received, certain, by_factor[lit], measured, seed
        )
    lamps = [
        replace(lamp, object_id=object_id, mixed=object_id in mixed)
        for lamp in lamps
        for object_id in groups[lamp.object_id]
    ]
    lamps = [as_shown(lamp, original) if lamp.mixed else lamp for lamp in lamps]
    for zone, radiance in zip(zones, sky.radiance, strict=True):
        environment = environment.with_zone(zone, radiance.astype(np.float32))
    # With all light known, what looked like a lamp for want of it does so no more.
    if sunlit.any():
        field = with_sunlight(field, sunlit, sun)
    irradiance = irradiance_at(
        field.with_light(lit_by(field, lamps), environment, [lamp.object_id for lamp in lamps]), element, seed
    )
    sure = bright_all_over(field, element, irradiance)
    reusable = Contributions(sunless, sky_contributions, sample.element, contribution, min_luminance)
    notes = sky_notes + tuple(sky.notes())
    return Light(tuple(sure) + tuple(lamps), environment, notes, element, irradiance, reusable, mixed, sun)


def with_sunlight(field: LightField, sunlit: np.ndarray, factor: np.ndarray) -> LightField:
    """The field with its sun, and what it makes `sunlit` elements send, so many times as bright ((3,))."""
    assert field.sun is not None
    radiance = np.where(sunlit[:, None], field.radiance * np.float32(factor), field.radiance)
    return field.with_sun(replace(field.sun, irradiance=field.sun.irradiance * np.float32(factor))).with_light(radiance)


def bright_all_over(field: LightField, element: np.ndarray, irradiance: np.ndarray) -> list[Lamp]:
    """`find_seen` by a few elements, (m,) int, and E there, (m, 3), less what all that frames show of it says is none.

    The pixels that show a small metal unmixed may be those of a highlight.
    """
    atlas, lamps = field.atlas, []
    for lamp in find_seen(atlas.object_id[element], field.radiance[element], irradiance):
        elements = atlas.elements_of(lamp.object_id)
        elements = elements[field.radiance[elements].any(1)]
        E = np.median(irradiance[atlas.object_id[element] == lamp.object_id], 0)
        if find_seen(atlas.object_id[elements], field.radiance[elements], np.broadcast_to(E, (len(elements), 3))):
            lamps.append(lamp)
    return lamps


def as_shown(lamp: Lamp, field: LightField) -> Lamp:
    """A lamp that pixels show mixed, as bright as they do if it was solved to be about that: they were hardly mixed."""
    radiance = np.median(field.radiance[field.atlas.elements_of(lamp.object_id)], 0)
    ratio = float(lamp.radiance @ LUMINANCE) / max(float(radiance @ LUMINANCE), 1e-12)
    return Lamp(lamp.object_id, radiance, True) if abs(ratio - 1) < LIGHT_FIT.alike else lamp


def lit_by(field: LightField, lamps: list[Lamp]) -> np.ndarray:
    """L_d with the radiance of lamps put in, and its object's where nobody saw an element, (n, 3) float32."""
    radiance = filled_radiance(field)
    for lamp in lamps:
        radiance[field.atlas.elements_of(lamp.object_id)] = lamp.radiance
    return radiance
