"""How bright the present light is beside the captured one, in stops, without a picture.

Light adds up, so each source is looked at once, alone: how much of it, at a strength of 1, arrives directly at places
that the camera's picture shows and at places all over the room, by rays. From the latter follows what the room's walls
throw back: in a room of albedo rho, rho / (1 - rho) of what falls on them, evenly, as in an integrating sphere (Goebel,
Applied Optics 6, 1967). Then both lights are but sums of numbers, quick enough for a panel. Tried against Cycles it is
right within a stop, but where little light reaches the view, as a narrow beam's.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Vector

from ...core.brdf.lambertian import USUAL_ALBEDO
from ...core.scene.sphere import fibonacci
from ..data.arrays import triangles_of, vertices_of
from ..light import lamps as relight_lamps
from ..light import outside
from ..light.kelvin import luminance
from ..light.room import PICTURE, bounds, cast, leaves, picture_ray
from ..light.units import LUMENS_PER_WATT, efficacy

_AROUND, _ON_LAMP = 64, 6
"""Rays: all over the room, from the camera and from its middle; from each place to a lamp."""
_ALMOST = 0.02
NO_LIGHT = -math.inf
Source = Callable[[Vector], Iterator[tuple[Vector, float, float]]]
"""From a place to unit directions towards a source, distances, and irradiances across each where nothing is between."""


@dataclass
class Known:
    """Of one view: places with their normals, first those `seen` in the picture, then those all over the room with the
    square metres that each stands for; irradiance of what is seen by each source at a strength of 1, by its key.
    """

    view: tuple
    places: list[tuple[Vector, Vector]]
    seen: int
    areas: np.ndarray
    reaches: dict[tuple, np.ndarray] = field(default_factory=dict)


_known: dict[str, Known] = {}


def stops(scene: bpy.types.Scene) -> float | None:
    """How many stops the present light is brighter than the captured one, where the camera looks.

    Returns
    -------
    float or None
        `NO_LIGHT` where all is dark; None as long as `looking` has not been run for this view and these lights.
    """
    if scene.camera is None or not is_known(scene):
        return None
    reaches, light = _known[scene.name].reaches, np.zeros((2, max(_known[scene.name].seen, 1)))
    for key, *strengths in _sources(scene):
        light += np.outer(strengths, reaches[key])
    present, captured = np.median(light, axis=1)
    if not captured > 0:
        return None
    return math.log2(present / captured) if present > 1e-6 * captured else NO_LIGHT


def is_known(scene: bpy.types.Scene) -> bool:
    """Whether `stops` has all that it needs, or can't be answered at all, as without a camera."""
    known = _known.get(scene.name)
    return scene.camera is None or (
        known is not None and known.view == _view(scene) and all(key in known.reaches for key, _, _ in _sources(scene))
    )


def looking(scene: bpy.types.Scene) -> Iterator[None]:
    """Find what `stops` has to know, in small steps; nothing where it is known, or there is no camera."""
    if scene.camera is None:
        return
    known = _known.get(scene.name)
    if known is None or known.view != _view(scene):
        known = Known(_view(scene), *_places(scene))
    reaches = {}
    for key, _, _ in _sources(scene):
        reaches[key] = known.reaches.get(key)
        if reaches[key] is None:
            source, found = _source(scene, key), []
            for place, normal in known.places:
                found.append(_arriving(scene, source, place, normal))
                yield
            around = _all_over(scene, key, known.areas, found[known.seen :])
            reaches[key] = np.array(found[: known.seen] or [0.0]) + around * USUAL_ALBEDO / (1 - USUAL_ALBEDO)
    known.reaches = reaches
    _known[scene.name] = known


def estimate(scene: bpy.types.Scene) -> float | None:
    """`stops`, after all the looking that it takes: some tenths of a second where the view or a lamp is new."""
    for _ in looking(scene):
        pass
    return stops(scene)


def _view(scene) -> tuple:
    camera, render = scene.camera, scene.render
    return camera.name, _rounded(camera), round(camera.data.lens, 3), render.resolution_x, render.resolution_y


def _rounded(thing) -> tuple:
    return tuple(round(c, 4) for row in thing.matrix_world for c in row)


def _places(scene) -> tuple[list, int, np.ndarray]:
    """The first fields of `Known`; no place is on a lamp."""
    rays = [picture_ray(scene, *place) for place in PICTURE]
    seen = len(hits := [hit for ray in rays if (hit := cast(scene, *ray)) and not _is_lamp(hit.thing)])
    areas = []
    for start in (scene.camera.matrix_world.translation, sum(bounds(scene), Vector()) / 2):
        for direction in map(Vector, fibonacci(_AROUND)):
            hit = cast(scene, start, direction)
            if hit is not None and not _is_lamp(hit.thing):
                hits.append(hit)
                areas.append(hit.distance**2 / max(-hit.normal.dot(direction), 0.2))
    return [(hit.place + 1e-3 * hit.normal, hit.normal) for hit in hits], seen, np.array(areas) * 2 * math.pi / _AROUND


def _is_lamp(thing) -> bool:
    return any(relight_lamps.is_lamp(slot.material) for slot in thing.material_slots)


def _sources(scene) -> Iterator[tuple[tuple, float, float]]:
    """Of each source its key, which tells all that its reach depends on, and its strength now and as captured."""
    for lamp in relight_lamps.find_lamps(scene):
        now, then = relight_lamps.radiance(lamp), relight_lamps.recovered_radiance(lamp)
        yield ("lamp", lamp.name), luminance(now), luminance(then)
    for thing in scene.objects:
        if thing.type == "LIGHT" and not thing.hide_render:
            data = thing.data
            shape = tuple(round(getattr(data, name, 0.0), 4) for name in ("spread", "spot_size", "spot_blend"))
            key = "light", thing.name, data.type, _rounded(thing), shape
            yield key, data.energy * efficacy(data) / LUMENS_PER_WATT, 0.0
    now, then = scene.world, outside.recovered_world(scene)
    if now is not None:
        yield ("world", now.name, round(outside.rotation(now), 4)), outside.strength(now), 0.0
    if then is not None:
        yield ("world", then.name, 0.0), 0.0, outside.recovered_strength(then)


def _source(scene, key: tuple) -> Source:
    kind, name, *rest = key
    if kind == "lamp":
        return _lamp(scene, name)
    if kind == "light":
        return _light(scene.objects[name])
    fields = outside.sky(bpy.data.worlds[name], rest[0])
    return lambda place: ((direction, math.inf, light) for direction, light in fields)


def _arriving(scene, source: Source, place: Vector, normal: Vector) -> float:
    total = 0.0
    for way, distance, strength in source(place):
        cosine = normal.dot(way)
        if cosine > 0 and strength > 0:
            far = distance == math.inf
            if leaves(scene, place, way) if far else cast(scene, place, way, distance - _ALMOST) is None:
                total += cosine * strength
    return total


def _all_over(scene, key: tuple, areas: np.ndarray, found: list[float]) -> float:
    """Irradiance on the room's surfaces on average: by rays, or by what a lamp of Blender's sends out."""
    area = max(float(areas.sum()), 1e-6)
    data = scene.objects[key[1]].data if key[0] == "light" else None
    if data is None or data.type == "SUN":
        return float(areas @ found) / area if found else 0.0
    return ((1 - math.cos(data.spot_size / 2)) * (1 - data.spot_blend / 2) / 2 if data.type == "SPOT" else 1.0) / area


def _lamp(scene, name: str) -> Source:
    """A recovered lamp of radiance 1, by some places on it."""
    owner = next(
        one for one, lamps in relight_lamps.lamps_by_object(scene).items() if bpy.data.materials[name] in lamps
    )
    data = scene.objects[owner].data
    three = vertices_of(data, scene.objects[owner].matrix_world)[triangles_of(data)]
    across = np.cross(three[:, 1] - three[:, 0], three[:, 2] - three[:, 0]) / 2
    areas = np.linalg.norm(across, axis=1)
    whole = areas.sum()
    if not whole > 0:
        return lambda place: iter(())
    chosen = np.searchsorted(np.cumsum(areas) / whole, (np.arange(_ON_LAMP) + 0.5) / _ON_LAMP).clip(max=len(areas) - 1)
    spots = [(Vector(three[k].mean(0)), Vector(across[k] / areas[k])) for k in chosen]
    both = not any(node.type == "NEW_GEOMETRY" for node in bpy.data.materials[name].node_tree.nodes)
    part = whole / _ON_LAMP

    def arriving(place: Vector) -> Iterator[tuple[Vector, float, float]]:
        for spot, facing in spots:
            way, distance = _way(place, spot)
            leaving = -facing.dot(way)
            yield way, distance, (abs(leaving) if both else leaving) * part / max(distance**2, part)

    return arriving


def _light(thing: bpy.types.Object) -> Source:
    """A lamp of Blender's of 1 W, or a sun of 1 W per square metre; see `relight.lights`."""
    data, pose = thing.data, thing.matrix_world
    shines = (pose.to_3x3() @ Vector((0, 0, -1))).normalized()
    if data.type == "SUN":
        return lambda place: iter([(-shines, math.inf, 1.0)])

    def intensity(leaving: float) -> float:
        if data.type == "AREA":
            half, angle = data.spread / 2, math.acos(min(max(leaving, -1.0), 1.0))
            if leaving <= 0 or angle >= half:
                return 0.0
            fading = 1.0 if half > 1.56 else (math.tan(half) - math.tan(angle)) / (math.tan(half) - half)
            return leaving * fading / math.pi
        if data.type != "SPOT":
            return 1 / (4 * math.pi)
        edge = math.cos(data.spot_size / 2)
        return min(max((leaving - edge) / max((1 - edge) * data.spot_blend, 1e-3), 0.0), 1.0) / (4 * math.pi)

    def arriving(place: Vector) -> Iterator[tuple[Vector, float, float]]:
        way, distance = _way(place, pose.translation)
        yield way, distance, intensity(-shines.dot(way)) / distance**2

    return arriving


def _way(place: Vector, to: Vector) -> tuple[Vector, float]:
    """Unit direction and metres from one place to another."""
    distance = max((to - place).length, 1e-3)
    return (to - place) / distance, distance
