"""Light that no frame looked at, solved for from what it throws onto the surfaces that the frames do see.

A lamp behind the camera, or the sky above what the windows showed, still lights the room. Albedo varies little within
an object, light a lot: the radiance under which albedo varies least is the one taken (`light_fit`). Lamps are found one
by one, then all that was solved is refined together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..capture.model import Instance
from ..parallel import for_blocks
from .emitters import BRIGHT, LUMINANCE, bright_triangles
from .environment import Environment
from .field import LightField
from .irradiance import direct, gather
from .lamps import AGREES, EMITTER_ALBEDO, Lamp, find_seen, twin
from .light_fit import CAP, CLIPPED_CAP, Sample, kinds_of, on_flat
from .portals import find_portals
from .refine_light import Sky, all_light, refined, shared_by_class
from .sun import sunlight

SAMPLES = 4000
"""Elements that the test looks at, spread evenly over the objects. Noise in E or G draws the solved radiance to 0: few
elements with many rays each find more of it than many with few (a sky of 1.7: 16,000 with 64 rays give 1.4)."""
CLIPPED = 4
"""Times as many where lamps are clipped, as then all albedos hang on the solution; no object counts for more than it
does among `SAMPLES`. Lamps over the truth in perturbed living rooms, two seeds each: 0.99 +- 0.06 with 4,000 elements
(seven scans), 1.01 +- 0.035 with 16,000 (six), 1.07 +- 0.02 where large objects count for more (three)."""
MIN_GAIN = 0.03
"""A lamp nobody saw is believed in when it lowers the spread of log albedo by at least this share."""
MIN_SKY_GAIN = 0.1
"""The same for a sky of which no frame saw anything: all albedos hang on it."""
MIN_OPEN = 0.02
"""Share of the received directions that must lead outside for such a sky to be looked for."""
MIN_SKY = 0.01
"""Part of the received light below which a part of the sky can't be solved for; its neighbours' radiance stays."""
MOST_TILTED = 0.14
"""Radians (8 degrees, as cells that count as flat). The living room perturbed, four seeds: its clipped lamp of 26.2
comes out at 26.4 +- 0.8, and at 25.7 +- 1.2 with all elements of such cells."""
SWEEPS = 2
LEAST, ENOUGH = 30, 200
"""Elements with which a solution can be tried; those on flat spots from which on the others are left out."""
RAYS, EMITTER_RAYS, PORTAL_RAYS = 256, 64, 64
ELEMENTS_AT_ONCE = 1 << 10


@dataclass(frozen=True)
class Thrown:
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
        E there from each unseen object at radiance 1.
    least : dict of float
        Luminance below which each would be no lamp.
    """

    received: np.ndarray
    sky: list[np.ndarray]
    element: np.ndarray
    lamps: dict[int, np.ndarray]
    least: dict[int, float]


@dataclass(frozen=True)
class Light:
    """All light of the room, as far as it can be known.

    Attributes
    ----------
    lamps : tuple of Lamp
    environment : Environment
        With the unseen parts of the sky solved for where they could be.
    notes : tuple of str
        What was solved, one sentence each.
    element : (m,) int
        Those that it was solved at.
    received : (m, 3) float64
        E there by all of this light.
    thrown : Thrown, optional
    """

    lamps: tuple[Lamp, ...]
    environment: Environment
    notes: tuple[str, ...]
    element: np.ndarray
    received: np.ndarray
    thrown: Thrown | None = None


def _pick(field: LightField, good: np.ndarray, seed: int, samples: int) -> np.ndarray:
    """At most so many good elements, evenly over the objects that have them."""
    rng = np.random.default_rng(seed)
    element = np.flatnonzero(good)
    objects = field.atlas.object_id[element]
    each = max(samples // max(len(np.unique(objects)), 1), 50)
    chosen = []
    for object_id in np.unique(objects):
        own = element[objects == object_id]
        chosen.append(own if len(own) <= each else rng.choice(own, each, replace=False))
    return np.sort(np.concatenate(chosen)) if chosen else np.zeros(0, np.int64)


def _steady(field: LightField, good: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """The good elements, (n,) bool: of an object with enough on flat spots, those."""
    object_id = field.atlas.object_id
    count = np.bincount(object_id, good & flat)
    return good & (flat | (count < LEAST)[object_id])


def _barely_seen(field: LightField, good: np.ndarray) -> np.ndarray:
    """Elements of bright objects that have no good one, (n,) bool: a lamp may be smaller than a pixel.

    What nobody saw is dark in `field`, so it is not among them.
    """
    luminance, atlas = field.radiance @ LUMINANCE, field.atlas
    seen = (luminance > 0) & ~np.isin(atlas.object_id, atlas.object_id[good])
    level = BRIGHT * float((luminance * atlas.area).sum() / max(atlas.area.sum(), 1e-30))
    objects = np.unique(atlas.object_id[seen])
    bright = [i for i in objects if np.median(luminance[seen & (atlas.object_id == i)]) > level]
    return seen & np.isin(atlas.object_id, bright)


def _evened(field: LightField) -> np.ndarray:
    """L_d with the median of its object where nobody saw an element ((n, 3) float32): it is dark there in `field`."""
    radiance, atlas = field.radiance.copy(), field.atlas
    seen = radiance.any(1)
    for object_id in np.unique(atlas.object_id[~seen]):
        own = atlas.object_id == object_id
        if (own & seen).any():
            radiance[own & ~seen] = np.median(radiance[own & seen], 0)
    return radiance


def _with_whole_sky(field: LightField, element: np.ndarray, seed: int) -> tuple[LightField, tuple[str, ...]]:
    """Solve for one radiance of all the sky where rays leave the mesh but no frame looked there; says so in a note."""
    if field.environment.seen:
        return field, ()
    everywhere = Environment.only(np.ones((1, 2), np.float32))
    dark = field.with_sun(None).with_light(np.zeros_like(field.radiance), everywhere)
    thrown = irradiance_at(dark, element, seed)[:, 0]
    if thrown.mean() < MIN_OPEN * np.pi:
        return field, ()
    received = irradiance_at(field.with_light(_evened(field)), element, seed)
    object_id, sent = field.atlas.object_id[element], field.radiance[element].astype(np.float64)
    left = np.ones(len(element), bool)
    for _ in range(SWEEPS):
        sample = Sample(element[left], object_id[left], sent[left], received[left])
        found = sample.best(sent[left] @ LUMINANCE, received[left] @ LUMINANCE, thrown[left])
        if found is None or found[2] > (1 - MIN_SKY_GAIN) * found[1]:
            return field, ()
        # Lamps show themselves once the rest is lit; their albedo says nothing of the sky.
        lamps = find_seen(object_id, sent, received + found[0] * thrown[:, None])
        left = ~np.isin(object_id, [lamp.object_id for lamp in lamps])
        if left.sum() < 30:
            return field, ()
    radiance = np.full(3, found[0])
    at = np.searchsorted(element, sample.element)
    by_channel = [sample.best(sample.radiance[:, c], sample.received[:, c], thrown[at]) for c in range(3)]
    if all(one is not None for one in by_channel):
        radiance = np.array([one[0] for one in by_channel])
    # No object reflects more than it gets.
    least = (np.pi * sample.radiance - sample.received) / np.maximum(thrown[at], 1e-3 * thrown.mean())[:, None]
    for one in np.unique(sample.object_id):
        radiance = np.maximum(radiance, np.median(least[object_id[left] == one], 0))
    note = (
        "Part of the light comes from a sky that no frame sees; it was solved from what it throws, as one radiance "
        f"from all sides: {', '.join(f'{x:.3g}' for x in radiance)} "
        f"(spread of log albedo {found[1]:.3f} to {found[2]:.3f})."
    )
    sky = Environment(np.broadcast_to(np.float32(radiance), (1, 2, 3)).copy(), np.zeros((1, 2), np.int32))
    return field.with_light(field.radiance, sky), (note,)


def irradiance_at(field: LightField, element: np.ndarray, seed: int) -> np.ndarray:
    """E of a few elements by both estimators, and from the sun, (m, 3) float64."""
    bright, portals = bright_triangles(field), find_portals(field, seed)
    position, normal = field.atlas.position[element], field.atlas.normal[element]
    E = np.empty((len(element), 3))

    def run(part: slice) -> None:
        p, n, own = position[part], normal[part], seed + part.start
        around, _, _ = gather(field, bright, p, n, RAYS, EMITTER_RAYS, own, portals, PORTAL_RAYS)
        E[part] = around + direct(field, bright, p, n, RAYS, EMITTER_RAYS, own + 1)[0]

    for_blocks(run, len(element), ELEMENTS_AT_ONCE, 0)
    return E if field.sun is None else E + from_sun(field, element)


def from_sun(field: LightField, element: np.ndarray) -> np.ndarray:
    """The sun's part of E, (m, 3) float32."""
    atlas = field.atlas
    return sunlight(field.scene, field.sun, atlas.position[element], atlas.normal[element], atlas.texel_edge)[:, :3]


def _thrown_by_object(field: LightField, element: np.ndarray, object_id: int, seed: int) -> np.ndarray:
    """E from one object at radiance 1 and nothing else, (m,) float64."""
    alone = np.repeat((field.atlas.object_id == object_id)[:, None], 3, 1).astype(np.float32)
    lit = field.with_sun(None).with_light(alone, Environment.dark(), [object_id])
    return irradiance_at(lit, element, seed)[:, 0]


def _most_reflected(field: LightField, object_id: int, seed: int) -> float:
    """Luminance that an object would send out at an albedo of `EMITTER_ALBEDO`, in the median over its elements."""
    own = _pick(field, field.atlas.object_id == object_id, seed, SAMPLES)[:500]
    return EMITTER_ALBEDO / np.pi * float(np.median(irradiance_at(field, own, seed) @ LUMINANCE))


def find_light(
    field: LightField,
    good: np.ndarray,
    unseen_objects: list[int],
    instances: tuple[Instance, ...],
    seed: int = 0,
    tilted: np.ndarray | None = None,
    colours: dict[int, np.ndarray] | None = None,
    before: Light | None = None,
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
    tilted : (n,) float, optional
        Radians, how far the mesh's noise may have turned each element: E of those turned much tells little.
    colours : dict of (3,) float, optional
        Colour of light that is known of unseen objects, of luminance 1.
    before : Light, optional
        What was found in the same room without its sun.
    """
    flat = on_flat(field.atlas)
    if tilted is not None:
        flat &= tilted < MOST_TILTED
    clipped = any(i in (colours or {}) for i in unseen_objects)
    usable = _steady(field, good, flat) | _barely_seen(field, good)
    # What a mirror shows is no albedo.
    usable &= ~np.isin(field.atlas.object_id, [mirror.object_id for mirror in field.mirrors])
    element = _pick(field, usable, seed, CLIPPED * SAMPLES if clipped else SAMPLES)
    if not len(element):
        return Light((), field.environment, (), element, np.zeros((0, 3)))
    old = before.thrown if before is not None and field.environment.seen else None
    field, found = _with_whole_sky(field, element, seed)
    environment, atlas = field.environment, field.atlas
    zones = environment.unseen_zones() if environment.seen else []
    if environment.clipped.any():
        zones.append(environment.clipped_zone())
    known = environment
    for zone in zones:
        known = known.with_zone(zone, np.zeros(3, np.float32))
    dark, unlit = np.zeros_like(field.radiance), field.with_sun(None)
    received = old.received if old else irradiance_at(unlit.with_light(_evened(field), known), element, seed)
    thrown_sky = old.sky if old else [
        irradiance_at(unlit.with_light(dark, Environment.only(zone.pattern)), element, seed)[:, 0] for zone in zones
    ]
    sunless = received
    if field.sun is not None:
        received = received + from_sun(field, element)
    guess = [environment.zone_mean(zone).astype(np.float64) for zone in zones]
    filled = received + sum(G[:, None] * s for G, s in zip(thrown_sky, guess, strict=True))
    seen = find_seen(atlas.object_id[element], field.radiance[element], filled)
    lit = ~np.isin(atlas.object_id[element], [lamp.object_id for lamp in seen])
    if (lit & flat[element]).sum() >= ENOUGH:
        lit &= flat[element]
    if lit.sum() < LEAST:
        return Light(tuple(seen), environment, found, element, filled)
    sent = field.radiance[element[lit]].astype(np.float64)
    # About half of the elements are on flat spots, of large objects as of small ones.
    most = SAMPLES / len(np.unique(atlas.object_id[element])) / 2 if clipped else np.inf
    sample = Sample(element[lit], atlas.object_id[element[lit]], sent, filled[lit], most)
    if old and np.array_equal(old.element, sample.element):
        thrown, least = old.lamps, old.least
    else:
        thrown = {i: _thrown_by_object(field, sample.element, i, seed) for i in unseen_objects}
        # What it could reflect of the light that reaches it is no reason to call an unseen object a lamp.
        lit_room = field.with_light(field.radiance, environment)
        least = {i: _most_reflected(lit_room, i, seed) for i in unseen_objects}

    sky = Sky([G[lit] for G in thrown_sky], guess, bool(environment.clipped.any()), [zone.told for zone in zones])
    lamps: list[Lamp] = []
    colours = shared_by_class(colours or {}, unseen_objects, instances)
    for sweep in range(SWEEPS):
        lamps = _solve_lamps(sample, thrown, least, instances, seen, sky, received[lit], colours)
        _solve_sky(sample, lamps, thrown, sky, received[lit])
        if not zones or sweep == SWEEPS - 1:
            break
    lamps, sky = _needed(sample, lamps, thrown, sky, received[lit], colours)
    log_albedo = np.log(np.maximum(sent, 1e-9) / np.maximum(all_light(received[lit], lamps, thrown, sky), 1e-12))
    class_of = {i.object_id: i.class_name for i in instances}
    kind = kinds_of(sample.object_id, log_albedo, class_of)
    sample = replace(sample, kind=kind, cap=CLIPPED_CAP if clipped else CAP)
    lamps = refined(sample, lamps, thrown, least, instances, seen, sky, received[lit], colours)
    for zone, radiance in zip(zones, sky.radiance, strict=True):
        environment = environment.with_zone(zone, radiance.astype(np.float32))
    # With all light known, what looked like a lamp for want of it does so no more.
    everything = irradiance_at(
        field.with_light(lit_by(field, lamps), environment, [lamp.object_id for lamp in lamps]), element, seed
    )
    sure = find_seen(atlas.object_id[element], field.radiance[element], everything)
    kept = Thrown(sunless, thrown_sky, sample.element, thrown, least)
    return Light(tuple(sure) + tuple(lamps), environment, found + tuple(sky.notes()), element, everything, kept)


def lit_by(field: LightField, lamps: list[Lamp]) -> np.ndarray:
    """L_d with the radiance of lamps put in, (n, 3) float32."""
    radiance = field.radiance.copy()
    for lamp in lamps:
        radiance[field.atlas.object_id == lamp.object_id] = lamp.radiance
    return radiance


def _solve_lamps(sample: Sample, thrown, least, instances, seen, sky: Sky, base, colours) -> list[Lamp]:
    """Unseen lamps, the one that explains most first; none once the gain falls below `MIN_GAIN`."""
    class_of = {i.object_id: i.class_name for i in instances}
    sent = sample.radiance @ LUMINANCE
    lamps: list[Lamp] = []
    left = dict(thrown)
    while left:
        received = all_light(base, lamps, thrown, sky) @ LUMINANCE
        found = {i: sample.best(sent, received, G) for i, G in left.items()}
        found = {i: f for i, f in found.items() if f is not None and f[2] < (1 - MIN_GAIN) * f[1] and f[0] > least[i]}
        if not found:
            break
        object_id = min(found, key=lambda i: found[i][2])
        by_channel = [
            sample.best(sample.radiance[:, c], all_light(base, lamps, thrown, sky)[:, c], left[object_id])
            for c in range(3)
        ]
        known = colours.get(object_id)
        lamps.append(_coloured(object_id, *found[object_id], class_of, seen, sample.received, by_channel, known))
        del left[object_id]
    return lamps


def _needed(sample: Sample, lamps: list[Lamp], thrown, sky: Sky, base, colours) -> tuple[list[Lamp], Sky]:
    """The lamps and sky found; lamps that nobody saw shine only where the sky alone, which is there, explains less."""
    shining = [lamp for lamp in lamps if lamp.object_id in colours]
    if not sky.thrown or len(shining) == len(lamps):
        return lamps, sky
    alone = Sky(sky.thrown, sky.guess, sky.clipped, sky.told)
    for _ in range(SWEEPS):
        _solve_sky(sample, shining, thrown, alone, base)
    sent = np.log(np.maximum(sample.radiance @ LUMINANCE, 1e-9))
    with_lamps, without = (
        sample.spread(sent - np.log(all_light(base, some, thrown, above) @ LUMINANCE + 1e-12))
        for some, above in ((lamps, sky), (shining, alone))
    )
    return (lamps, sky) if with_lamps < (1 - MIN_GAIN) * without else (shining, alone)


def _coloured(object_id, s, before, after, class_of, seen, received, by_channel, known) -> Lamp:
    """Give a solved luminance its colour.

    A seen lamp's of the same class if they agree; else that which is `known` from its edges; else what each channel
    says by itself, if together they make that luminance; else that of the lamps, or of the light.
    """
    how = f"No frame sees it; solved from the light it throws (spread of log albedo {before:.3f} to {after:.3f})"
    same = twin(object_id, s, class_of, seen)
    if same is not None:
        note = f"{how}: {s:.3g}, near the seen lamp {same.object_id} of its class, whose radiance it takes."
        return Lamp(int(object_id), same.radiance, False, note)
    if known is not None:
        return Lamp(int(object_id), (s * known).astype(np.float32), False, how + "; its colour from its edges.")
    alike = [lamp for lamp in seen if class_of.get(lamp.object_id) == class_of.get(object_id)]
    if not alike and all(found is not None for found in by_channel):
        colour = np.float32([found[0] for found in by_channel])
        if abs(float(colour @ LUMINANCE) / s - 1) < AGREES:
            return Lamp(int(object_id), colour, False, how + ".")
    white = np.mean([lamp.radiance for lamp in alike or seen], 0) if seen else received.mean(0)
    return Lamp(int(object_id), (s * white / max(float(white @ LUMINANCE), 1e-12)).astype(np.float32), False, how + ".")


def _solve_sky(sample: Sample, lamps, thrown, sky: Sky, base) -> None:
    """Radiance of the sky's unknown parts, channel by channel, one after another."""
    for i, G in enumerate(sky.thrown):
        others = all_light(base, lamps, thrown, sky, without=i)
        if (G[:, None] * sky.guess[i]).mean() < MIN_SKY * others.mean():
            continue
        solved = [sample.best(sample.radiance[:, c], others[:, c], G) for c in range(3)]
        if any(found is None for found in solved):
            continue
        sky.solved.add(i)
        sky.radiance[i] = np.clip([found[0] for found in solved], *sky.bounds(i))
