"""Lamps: objects that give more light than they could reflect, and lamps that no frame looked at.

A lamp that the frames see is found by the albedo it would need. A lamp that no frame sees still lights the room: its
radiance is solved for from that light, as the one under which the surfaces' albedos vary least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from ..capture.model import Instance
from .emitters import LUMINANCE, bright_triangles
from .environment import Environment
from .field import LightField
from .irradiance import direct, gather

EMITTER_ALBEDO = 2.0
"""An object whose median albedo would have to be above this gives light of its own. 1 is the physical bound; the rest
is room for missing light and for noise."""
SAMPLES = 20000
"""Elements that the test looks at, spread evenly over the objects."""
MIN_GAIN = 0.03
"""A lamp nobody saw is believed in when it lowers the spread of log albedo by at least this share."""
CLASS_AGREES = 0.25
"""If the solved luminance lies this near (relative) to a seen lamp of the same class, that lamp's radiance is taken."""
RAYS, EMITTER_RAYS = 256, 32


@dataclass(frozen=True)
class Lamp:
    """One object that gives light.

    Attributes
    ----------
    object_id : int
    radiance : (3,) float32
        Median over its elements, or solved for.
    seen : bool
        False: solved for from the light that it throws.
    note : str
        How the radiance was found, where that needs saying.
    """

    object_id: int
    radiance: np.ndarray
    seen: bool
    note: str = ""


@dataclass(frozen=True)
class _Sample:
    """Elements with a good L_d, what reaches them, and what they send out."""

    element: np.ndarray
    object_id: np.ndarray
    radiance: np.ndarray
    irradiance: np.ndarray


def _pick(field: LightField, good: np.ndarray, seed: int) -> np.ndarray:
    """At most `SAMPLES` good elements, evenly over the objects that have them."""
    rng = np.random.default_rng(seed)
    element = np.flatnonzero(good)
    objects = field.atlas.object_id[element]
    each = max(SAMPLES // max(len(np.unique(objects)), 1), 50)
    chosen = []
    for object_id in np.unique(objects):
        own = element[objects == object_id]
        chosen.append(own if len(own) <= each else rng.choice(own, each, replace=False))
    return np.sort(np.concatenate(chosen)) if chosen else np.zeros(0, np.int64)


def _irradiance(field: LightField, normals: np.ndarray, element: np.ndarray, seed: int) -> np.ndarray:
    """E of a few elements by both estimators, (n, 3) float32."""
    bright = bright_triangles(field)
    position, normal = field.atlas.position[element], field.atlas.normal[element]
    around, _, _ = gather(field, bright, normals, position, normal, RAYS, EMITTER_RAYS, seed)
    return around + direct(field, bright, position, normal, RAYS, EMITTER_RAYS, seed + 1)


def _spread(log_ratio: np.ndarray, group: np.ndarray, groups: int) -> float:
    """Mean absolute deviation of log albedo from its object's median; outliers count at most 1."""
    order = np.lexsort((log_ratio, group))
    count = np.bincount(group, minlength=groups)
    start = np.concatenate([[0], np.cumsum(count)[:-1]])
    has = count > 0
    median = np.zeros(groups)
    median[has] = log_ratio[order[(start + count // 2)[has]]]
    return float(np.minimum(np.abs(log_ratio - median[group]), 1).mean())


def find_seen(sample: _Sample) -> list[Lamp]:
    """Objects whose albedo pi L_d / E would have to be above `EMITTER_ALBEDO`."""
    luminance, received = sample.radiance @ LUMINANCE, sample.irradiance @ LUMINANCE
    lamps = []
    for object_id in np.unique(sample.object_id):
        own = sample.object_id == object_id
        if np.median(np.pi * luminance[own] / np.maximum(received[own], 1e-12)) > EMITTER_ALBEDO:
            lamps.append(Lamp(int(object_id), np.median(sample.radiance[own], 0), True))
    return lamps


def solve_unseen(
    field: LightField,
    normals: np.ndarray,
    sample: _Sample,
    candidates: list[int],
    instances: tuple[Instance, ...],
    seen: list[Lamp],
    seed: int,
) -> list[Lamp]:
    """Radiance of objects that no frame sees, from the light that they throw.

    For a trial radiance s of an object the albedos are pi L_d / (E + s G), G being what the object throws at radiance
    1. The s that makes albedo vary least within the objects is taken, if it explains enough; one candidate after the
    other, strongest first.
    """
    dark = Environment(np.zeros((1, 2, 3), np.float32), np.zeros((1, 2), np.int32))
    _, group = np.unique(sample.object_id, return_inverse=True)
    groups = int(group.max()) + 1 if len(group) else 0
    luminance = np.log(np.maximum(sample.radiance @ LUMINANCE, 1e-9))
    received = (sample.irradiance @ LUMINANCE).astype(np.float64)
    class_of = {i.object_id: i.class_name for i in instances}
    thrown = {}
    for object_id in candidates:
        alone = np.repeat((field.atlas.object_id == object_id)[:, None], 3, 1).astype(np.float32)
        lit = field.with_radiance(alone)
        lit.environment = dark
        thrown[object_id] = _irradiance(lit, normals, sample.element, seed)[:, 0].astype(np.float64)
    lamps = []
    while thrown:
        best = None
        before = _spread(luminance - np.log(np.maximum(received, 1e-12)), group, groups)
        for object_id, G in thrown.items():
            if not (G > 0).any():
                continue
            # Where the trial lamp would give as much as all known light together: the scale to search around.
            scale = received.mean() / G.mean()

            def spread_at(log_s: float, G=G, received=received) -> float:
                return _spread(luminance - np.log(received + np.exp(log_s) * G + 1e-12), group, groups)

            grid = np.log(scale) + np.linspace(-4, 4, 33)
            costs = [spread_at(x) for x in grid]
            at = int(np.argmin(costs))
            if at == len(grid) - 1:
                continue  # more is always better: this says nothing about the lamp
            found = minimize_scalar(spread_at, bounds=(grid[max(at - 1, 0)], grid[at + 1]), method="bounded")
            if best is None or found.fun < best[1]:
                best = (object_id, float(found.fun), float(np.exp(found.x)))
        if best is None or best[1] > (1 - MIN_GAIN) * before:
            break
        object_id, after, s = best
        lamps.append(_colour(object_id, s, before, after, class_of, seen, sample, received, thrown[object_id]))
        received = received + float(lamps[-1].radiance @ LUMINANCE) * thrown.pop(object_id)
    return lamps


def _colour(object_id, s, before, after, class_of, seen, sample, received, G) -> Lamp:
    """Give a solved luminance its colour: a seen lamp's of the same class if they agree, else that of the light."""
    how = f"No frame sees it; solved from the light it throws (spread of log albedo {before:.3f} to {after:.3f})"
    alike = [lamp for lamp in seen if class_of.get(lamp.object_id) == class_of.get(object_id)]
    for lamp in alike:
        if abs(s / float(lamp.radiance @ LUMINANCE) - 1) < CLASS_AGREES:
            note = f"{how}: {s:.3g}, which agrees with the seen lamp {lamp.object_id} of its class, whose radiance it takes."
            return Lamp(object_id, lamp.radiance, False, note)
    white = np.mean([lamp.radiance for lamp in alike or seen], 0) if seen else sample.irradiance.mean(0)
    return Lamp(object_id, (s * white / max(float(white @ LUMINANCE), 1e-12)).astype(np.float32), False, how + ".")


def find_lamps(
    field: LightField,
    normals: np.ndarray,
    good: np.ndarray,
    seen_share: dict[int, float],
    instances: tuple[Instance, ...],
    seed: int = 0,
) -> list[Lamp]:
    """All lamps of the room, seen and unseen.

    Parameters
    ----------
    field : LightField
        With L_d filled in; what nobody saw must be dark in it, or it would hide the lamps looked for.
    normals : (t, 3) float32
    good : (n,) bool
        Elements whose L_d rests on enough clean observations, saturated ones included.
    seen_share : dict
        Share of each object's surface that any frame saw.
    """
    element = _pick(field, good, seed)
    if not len(element):
        return []
    sample = _Sample(
        element,
        field.atlas.object_id[element],
        field.radiance[element],
        _irradiance(field, normals, element, seed),
    )
    seen = find_seen(sample)
    lit = ~np.isin(sample.object_id, [lamp.object_id for lamp in seen])
    rest = _Sample(sample.element[lit], sample.object_id[lit], sample.radiance[lit], sample.irradiance[lit])
    unseen = [object_id for object_id, share in seen_share.items() if share == 0]
    return seen + solve_unseen(field, normals, rest, unseen, instances, seen, seed)
