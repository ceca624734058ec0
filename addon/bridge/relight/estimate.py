"""How bright the present light is beside the captured one, in stops, without a picture.

Light adds up, so each source is looked at once, alone: how much of it, at a strength of 1, arrives directly at places
that the camera's picture shows (`Reach.seen`) and at places all over the room (`Reach.around`), by rays. From the
latter follows what the room's walls throw back: in a room of albedo rho, rho / (1 - rho) of what falls on them, evenly,
as in an integrating sphere (Goebel, Applied Optics 6, 1967). Then both lights are but sums of numbers, quick enough for
a panel. Tried against Cycles it is right within a stop, but where little light reaches the view, as a narrow beam's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ..data.arrays import triangles_of, vertices_of
from ..light import lamps as relight_lamps
from ..light import outside
from ..light.kelvin import luminance
from ..light.outside import sky
from ..light.room import bounds, cast, leaves, picture_ray
from ..light.units import LUMENS_PER_WATT, efficacy

_GRID, _AROUND, _ON_LAMP, _SKY = 9, 128, 6, 24
"""Rays: a side of the picture, all over the room, to a lamp, to the sky (the last two from each place)."""
_ALBEDO = 0.5
_ALMOST = 0.02
_GOLDEN = math.pi * (3 - math.sqrt(5))
NO_LIGHT = -math.inf


@dataclass
class Reach:
    """What a source of strength 1 throws directly: irradiance on what is seen, and on the room's average surface."""

    seen: np.ndarray
    around: float


@dataclass
class Known:
    """Of one view: places and normals, square metres that each of `around` stands for, the sources by their keys."""

    view: tuple
    seen: list
    around: list
    areas: np.ndarray
    reaches: dict


_known: dict[str, Known] = {}


def stops(scene: bpy.types.Scene) -> float | None:
    """How many stops the present light is brighter than the captured one, where the camera looks.

    Returns
    -------
    float or None
        `NO_LIGHT` where all is dark; None as long as `looking` has not been run for this view and these lights.
    """
    known = _known.get(scene.name)
    if known is None or known.view != _view(scene):
        return None
    light = [0.0, 0.0]
    for key, now, then in _sources(scene):
        reach = known.reaches.get(key)
        if reach is None:
            return None
        total = reach.seen + reach.around * _ALBEDO / (1 - _ALBEDO)
        light = [light[0] + now * total, light[1] + then * total]
    present, captured = (float(np.median(one)) if np.ndim(one) else 0.0 for one in light)
    if not captured > 0:
        return None
    return math.log2(present / captured) if present > 1e-6 * captured else NO_LIGHT


def is_known(scene: bpy.types.Scene) -> bool:
    """Whether `stops` has all that it needs, or can't be answered at all, as without a camera."""
    known = _known.get(scene.name)
    return (
        scene.camera is None
        or known is not None
        and known.view == _view(scene)
        and all(key in known.reaches for key, _, _ in _sources(scene))
    )


def looking(scene: bpy.types.Scene) -> Iterator[None]:
    """Find what `stops` has to know, in small steps; without effect where it is known, or there is no camera.

    Raises `BadInputError`: the scene holds no scanned room.
    """
    if scene.camera is None:
        return
    view = _view(scene)
    known = _known.get(scene.name)
    if known is None or known.view != view:
        known = Known(view, *_places(scene), {})
    fresh = [key for key, _, _ in _sources(scene)]
    lamps = _lamps(scene)
    for key in fresh:
        if key not in known.reaches:
            found = []
            for place, normal in (*known.seen, *known.around):
                found.append(_arriving(scene, key, lamps, place, normal))
                yield
            count = len(known.seen)
            known.reaches[key] = Reach(np.array(found[:count]), _all_over(scene, key, known, found[count:]))
    known.reaches = {key: known.reaches[key] for key in fresh}
    _known[scene.name] = known


def estimate(scene: bpy.types.Scene) -> float | None:
    """`stops`, after all the looking that it takes: some tenths of a second where the view or a lamp is new."""
    for _ in looking(scene):
        pass
    return stops(scene)


def _view(scene) -> tuple:
    camera = scene.camera
    if camera is None:
        return ()
    return (
        camera.name,
        *(round(c, 4) for row in camera.matrix_world for c in row),
        round(camera.data.lens, 3),
        scene.render.resolution_x,
        scene.render.resolution_y,
    )


def _places(scene) -> tuple[list, list, np.ndarray]:
    """Places and normals that the picture shows, those all over the room, and the square metres of each of these."""
    seen = []
    for k in range(_GRID * _GRID):
        hit = cast(scene, *picture_ray(scene, (k % _GRID + 0.5) / _GRID, (k // _GRID + 0.5) / _GRID))
        if hit is not None and not _is_lamp(hit.thing):
            seen.append((hit.place + 1e-3 * hit.normal, hit.normal))
    low, high = bounds(scene)
    middle, around, areas = (low + high) / 2, [], []
    for start in (scene.camera.matrix_world.translation, middle):
        for k in range(_AROUND // 2):
            z = 1 - (2 * k + 1) / (_AROUND // 2)
            r = math.sqrt(1 - z * z)
            direction = Vector((r * math.cos(_GOLDEN * k), r * math.sin(_GOLDEN * k), z))
            hit = cast(scene, start, direction)
            if hit is not None and not _is_lamp(hit.thing):
                around.append((hit.place + 1e-3 * hit.normal, hit.normal))
                areas.append(hit.distance**2 / max(-hit.normal.dot(direction), 0.2))
    return seen, around, np.array(areas) * 4 * math.pi / _AROUND


def _is_lamp(thing) -> bool:
    return any(relight_lamps.is_lamp(slot.material) for slot in thing.material_slots)


def _lamps(scene) -> dict[str, tuple]:
    """Each lamp's places, normals, areas, and whether it shines to both sides, by its material's name."""
    found: dict[str, tuple] = {}
    for name, lamps in relight_lamps.lamps_by_object(scene).items():
        thing = scene.objects[name]
        three = vertices_of(thing.data, thing.matrix_world)[triangles_of(thing.data)]
        across = np.cross(three[:, 1] - three[:, 0], three[:, 2] - three[:, 0]) / 2
        areas = np.linalg.norm(across, axis=1)
        if not areas.sum() > 0:
            continue
        edges = np.cumsum(areas) / areas.sum()
        chosen = np.searchsorted(edges, (np.arange(_ON_LAMP) + 0.5) / _ON_LAMP).clip(max=len(areas) - 1)
        for lamp in lamps:
            both = not any(node.type == "NEW_GEOMETRY" for node in lamp.node_tree.nodes)
            found[lamp.name] = (
                three[chosen].mean(1),
                across[chosen] / areas[chosen, None],
                areas.sum() / _ON_LAMP,
                both,
            )
    return found


def _sources(scene) -> Iterator[tuple[tuple, float, float]]:
    """Of each source its key, which tells all that its reach depends on, and its strength now and as captured."""
    for lamp in relight_lamps.find_lamps(scene):
        yield (
            ("lamp", lamp.name),
            luminance(relight_lamps.radiance(lamp)),
            luminance(relight_lamps.recovered_radiance(lamp)),
        )
    for thing in scene.objects:
        if thing.type == "LIGHT" and not thing.hide_render:
            data = thing.data
            pose = tuple(round(c, 4) for row in thing.matrix_world for c in row)
            shape = tuple(round(getattr(data, name, 0.0), 4) for name in ("spread", "spot_size", "spot_blend"))
            yield ("light", thing.name, data.type, pose, shape), data.energy * efficacy(data) / LUMENS_PER_WATT, 0.0
    worlds = (scene.world, outside.recovered_world(scene))
    strengths = (outside.strength(worlds[0]), outside.recovered_strength(worlds[1]))
    for k, world in enumerate(worlds):
        if world is not None:
            key = ("world", world.name, round(outside.rotation(world), 4) if k == 0 else 0.0)
            yield key, strengths[0] if k == 0 else 0.0, strengths[1] if k == 1 else 0.0


def _all_over(scene, key: tuple, known: Known, found: list[float]) -> float:
    """Irradiance on the room's surfaces on average: by rays, or by what a lamp of Blender's sends out."""
    area = max(float(known.areas.sum()), 1e-6)
    data = scene.objects[key[1]].data if key[0] == "light" else None
    if data is None or data.type == "SUN":
        return float(known.areas @ found) / area if found else 0.0
    if data.type == "SPOT":
        return (1 - math.cos(data.spot_size / 2)) * (1 - data.spot_blend / 2) / 2 / area
    return 1 / area


def _arriving(scene, key: tuple, lamps: dict, place: Vector, normal: Vector) -> float:
    if key[0] == "lamp":
        return _from_lamp(scene, lamps[key[1]], place, normal) if key[1] in lamps else 0.0
    if key[0] == "light":
        return _from_light(scene, scene.objects[key[1]], place, normal)
    return _from_sky(scene, bpy.data.worlds[key[1]], key[2], place, normal)


def _from_lamp(scene, lamp: tuple, place: Vector, normal: Vector) -> float:
    """Irradiance by a lamp of radiance 1: of the places on it, those that are in sight."""
    places, normals, area, both = lamp
    total = 0.0
    for on, facing in zip(places, normals, strict=True):
        way = Vector(on) - place
        distance = max(way.length, 1e-3)
        way /= distance
        cosine, leaving = normal.dot(way), -Vector(facing).dot(way)
        leaving = abs(leaving) if both else leaving
        if cosine <= 0 or leaving <= 0:
            continue
        if cast(scene, place, way, distance - _ALMOST) is None:
            total += cosine * leaving * area / max(distance**2, area)
    return total


def _from_light(scene, thing, place: Vector, normal: Vector) -> float:
    """Irradiance by a lamp of Blender's of 1 W, or a sun of 1 W per square metre; see `relight.lights`."""
    data, pose = thing.data, thing.matrix_world
    shines = (pose.to_3x3() @ Vector((0, 0, -1))).normalized()
    if data.type == "SUN":
        cosine = -normal.dot(shines)
        return cosine if cosine > 0 and leaves(scene, place, -shines) else 0.0
    way = pose.translation - place
    distance = max(way.length, 1e-3)
    way /= distance
    cosine, leaving = normal.dot(way), -shines.dot(way)
    if cosine <= 0 or cast(scene, place, way, distance - _ALMOST) is not None:
        return 0.0
    if data.type == "AREA":
        half, angle = data.spread / 2, math.acos(min(max(leaving, -1.0), 1.0))
        if leaving <= 0 or angle >= half:
            return 0.0
        fading = 1.0 if half > 1.56 else (math.tan(half) - math.tan(angle)) / (math.tan(half) - half)
        return cosine * leaving * fading / (math.pi * distance**2)
    inside = 1.0
    if data.type == "SPOT":
        edge = math.cos(data.spot_size / 2)
        inside = min(max((leaving - edge) / max((1 - edge) * data.spot_blend, 1e-3), 0.0), 1.0)
    return cosine * inside / (4 * math.pi * distance**2)


def _from_sky(scene, world, turn: float, place: Vector, normal: Vector) -> float:
    """Irradiance by a world at strength 1, through what of it is in sight."""
    across = normal.orthogonal().normalized()
    beside, total = normal.cross(across), 0.0
    for k in range(_SKY):
        radius, angle = math.sqrt((k + 0.5) / _SKY), _GOLDEN * k
        direction = (
            across * radius * math.cos(angle) + beside * radius * math.sin(angle) + normal * math.sqrt(1 - radius**2)
        )
        if leaves(scene, place, direction):
            total += sky(world, direction, turn)
    return total * math.pi / _SKY
