"""How much brighter the current light is than the captured one, in stops, without rendering.

Light is additive, so each source is evaluated once, alone: its direct irradiance, at a strength of 1, at points that
the camera's picture shows and at points all over the room, by rays. From the latter follows the indirect light: in a
room of albedo rho, rho / (1 - rho) of the mean irradiance, evenly, as in an integrating sphere (Goebel, Applied Optics
6, 1967). Then both lights are weighted sums, quick enough for a panel. Compared with Cycles the error is within a stop,
except where little light reaches the view, as with a narrow beam.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Vector

from ...core.brdf.lambertian import TYPICAL_ALBEDO
from ...core.scene.sphere import fibonacci
from ..data.arrays import read, triangles_of, vertices_of
from ..data.materials import shines_to_the_front
from ..light import lamps as relight_lamps
from ..light import outside
from ..light.kelvin import luminance
from ..light.room import PICTURE, bounds, cast, leaves, picture_ray
from ..light.units import LUMENS_PER_WATT, efficacy

_ROOM_RAYS, _LAMP_SAMPLES = 64, 6
"""Numbers of rays: all over the room, from the camera and from its middle each; from each point to a lamp."""
_TOLERANCE = 0.02
NO_LIGHT = -math.inf
Source = Callable[[Vector], Iterator[tuple[Vector, float, float]]]
"""From a point to unit directions towards a source, distances, and unoccluded irradiances perpendicular to each."""


@dataclass
class ViewCache:
    """Of one view: points with their normals, first the `visible_count` ones in the picture, then those all over the
    room, with the area in square metres that each represents; irradiance at the visible ones of each source at a
    strength of 1."""

    view: tuple
    points: list[tuple[Vector, Vector]]
    visible_count: int
    areas: np.ndarray
    irradiances: dict[tuple, np.ndarray] = field(default_factory=dict)


_caches: dict[str, ViewCache] = {}


def stops(scene: bpy.types.Scene) -> float | None:
    """How many stops the current light is brighter than the captured one, where the camera looks.

    `NO_LIGHT` where all is dark; None until `measure_in_steps` has been run for this view and these lights.
    """
    if scene.camera is None or not is_known(scene):
        return None
    irradiances, irradiance = _caches[scene.name].irradiances, np.zeros((2, max(_caches[scene.name].visible_count, 1)))
    for key, *strengths in _source_strengths(scene):
        irradiance += np.outer(strengths, irradiances[key])
    present, captured = np.median(irradiance, axis=1)
    if not captured > 0:
        return None
    return math.log2(present / captured) if present > 1e-6 * captured else NO_LIGHT


def is_known(scene: bpy.types.Scene) -> bool:
    """Whether `stops` has all that it needs, or nothing can be measured, as without a camera."""
    cache = _caches.get(scene.name)
    return scene.camera is None or (
        cache is not None
        and cache.view == _view(scene)
        and all(key in cache.irradiances for key, _, _ in _source_strengths(scene))
    )


def measure_in_steps(scene: bpy.types.Scene) -> Iterator[None]:
    """Compute what `stops` needs, in small steps; nothing where it is cached, or there is no camera."""
    if scene.camera is None:
        return
    cache = _caches.get(scene.name)
    if cache is None or cache.view != _view(scene):
        cache = ViewCache(_view(scene), *_sample_points(scene))
    irradiances = {}
    for key, _, _ in _source_strengths(scene):
        irradiances[key] = cache.irradiances.get(key)
        if irradiances[key] is None:
            source, direct = _source(scene, key), []
            for point, normal in cache.points:
                direct.append(_irradiance(scene, source, point, normal))
                yield
            mean = _mean_irradiance(scene, key, cache.areas, direct[cache.visible_count :])
            indirect = mean * TYPICAL_ALBEDO / (1 - TYPICAL_ALBEDO)
            irradiances[key] = np.array(direct[: cache.visible_count] or [0.0]) + indirect
    cache.irradiances = irradiances
    _caches[scene.name] = cache


def estimate(scene: bpy.types.Scene) -> float | None:
    """`stops`, after measuring what is missing: some tenths of a second where the view or a lamp is new."""
    for _ in measure_in_steps(scene):
        pass
    return stops(scene)


def _view(scene) -> tuple:
    camera, render = scene.camera, scene.render
    return camera.name, _rounded_pose(camera), round(camera.data.lens, 3), render.resolution_x, render.resolution_y


def _rounded_pose(obj) -> tuple:
    return tuple(round(value, 4) for row in obj.matrix_world for value in row)


def _sample_points(scene) -> tuple[list, int, np.ndarray]:
    """Points, visible count and areas of a `ViewCache`; no point is on a lamp."""
    rays = [picture_ray(scene, *place) for place in PICTURE]
    visible_count = len(hits := [hit for ray in rays if (hit := cast(scene, *ray)) and not _is_lamp(hit)])
    areas = []
    for start in (scene.camera.matrix_world.translation, sum(bounds(scene), Vector()) / 2):
        for direction in map(Vector, fibonacci(_ROOM_RAYS)):
            hit = cast(scene, start, direction)
            if hit is not None and not _is_lamp(hit):
                hits.append(hit)
                areas.append(hit.distance**2 / max(-hit.normal.dot(direction), 0.2))
    points = [(hit.location + 1e-3 * hit.normal, hit.normal) for hit in hits]
    return points, visible_count, np.array(areas) * 2 * math.pi / _ROOM_RAYS


def _is_lamp(hit) -> bool:
    return relight_lamps.is_lamp(hit.material)


def _source_strengths(scene) -> Iterator[tuple[tuple, float, float]]:
    """Key of each source, with all that its irradiance depends on, and its current and captured strength."""
    for lamp in relight_lamps.find_lamps(scene):
        present, captured = relight_lamps.radiance(lamp), relight_lamps.recovered_radiance(lamp)
        yield ("lamp", lamp.name), luminance(present), luminance(captured)
    for obj in scene.objects:
        if obj.type == "LIGHT" and not obj.hide_render:
            data = obj.data
            shape = tuple(round(getattr(data, name, 0.0), 4) for name in ("spread", "spot_size", "spot_blend"))
            key = "light", obj.name, data.type, _rounded_pose(obj), shape
            yield key, data.energy * efficacy(data) / LUMENS_PER_WATT, 0.0
    present, captured = scene.world, outside.recovered_world(scene)
    if present is not None:
        yield ("world", present.name, round(outside.rotation(present), 4)), outside.strength(present), 0.0
    if captured is not None:
        yield ("world", captured.name, 0.0), 0.0, outside.recovered_strength(captured)


def _source(scene, key: tuple) -> Source:
    kind, name, *parameters = key
    if kind == "lamp":
        return _lamp_source(scene, name)
    if kind == "light":
        return _light_source(scene.objects[name])
    samples = outside.sky(bpy.data.worlds[name], parameters[0])
    return lambda point: ((direction, math.inf, radiance) for direction, radiance in samples)


def _irradiance(scene, source: Source, point: Vector, normal: Vector) -> float:
    total = 0.0
    for direction, distance, strength in source(point):
        cosine = normal.dot(direction)
        if cosine > 0 and strength > 0:
            if distance == math.inf:
                is_visible = leaves(scene, point, direction)
            else:
                is_visible = cast(scene, point, direction, distance - _TOLERANCE) is None
            total += cosine * strength * is_visible
    return total


def _mean_irradiance(scene, key: tuple, areas: np.ndarray, irradiances: list[float]) -> float:
    """Mean irradiance on the room's surfaces: by rays, or from the power of a lamp of Blender's."""
    area = max(float(areas.sum()), 1e-6)
    data = scene.objects[key[1]].data if key[0] == "light" else None
    if data is None or data.type == "SUN":
        return float(areas @ irradiances) / area if irradiances else 0.0
    return ((1 - math.cos(data.spot_size / 2)) * (1 - data.spot_blend / 2) / 2 if data.type == "SPOT" else 1.0) / area


def _lamp_source(scene, name: str) -> Source:
    """A recovered lamp of radiance 1, by sample points on it."""
    lamp, by_object = bpy.data.materials[name], relight_lamps.lamps_by_object(scene)
    owner = scene.objects[next(object_name for object_name, lamps in by_object.items() if lamp in lamps)]
    data, slots = owner.data, [slot.material == lamp for slot in owner.material_slots]
    corners = vertices_of(data, owner.matrix_world)[triangles_of(data)]
    if not all(slots):  # of a part, its faces alone
        slot_of = read(data.loop_triangles, "material_index", kind=np.int32).clip(0, len(slots) - 1)
        corners = corners[np.array(slots)[slot_of]]
    area_vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    areas = np.linalg.norm(area_vectors, axis=1)
    total_area = areas.sum()
    if not total_area > 0:
        return lambda point: iter(())
    shares = (np.arange(_LAMP_SAMPLES) + 0.5) / _LAMP_SAMPLES
    chosen = np.searchsorted(np.cumsum(areas) / total_area, shares).clip(max=len(areas) - 1)
    samples = [(Vector(corners[k].mean(0)), Vector(area_vectors[k] / areas[k])) for k in chosen]
    two_sided = not shines_to_the_front(lamp)
    sample_area = total_area / _LAMP_SAMPLES

    def irradiance(point: Vector) -> Iterator[tuple[Vector, float, float]]:
        for sample, normal in samples:
            direction, distance = _direction_and_distance(point, sample)
            cosine = abs(normal.dot(direction)) if two_sided else -normal.dot(direction)
            yield direction, distance, cosine * sample_area / max(distance**2, sample_area)

    return irradiance


def _light_source(obj: bpy.types.Object) -> Source:
    """A lamp of Blender's of 1 W, or a sun of 1 W per square metre; see `relight.lights`."""
    data, pose = obj.data, obj.matrix_world
    axis = (pose.to_3x3() @ Vector((0, 0, -1))).normalized()
    if data.type == "SUN":
        return lambda point: iter([(-axis, math.inf, 1.0)])

    def intensity(cosine: float) -> float:
        if data.type == "AREA":
            half_spread, angle = data.spread / 2, math.acos(min(max(cosine, -1.0), 1.0))
            if cosine <= 0 or angle >= half_spread:
                return 0.0
            tangent = math.tan(half_spread)
            falloff = 1.0 if half_spread > 1.56 else (tangent - math.tan(angle)) / (tangent - half_spread)
            return cosine * falloff / math.pi
        if data.type != "SPOT":
            return 1 / (4 * math.pi)
        rim_cosine = math.cos(data.spot_size / 2)
        return min(max((cosine - rim_cosine) / max((1 - rim_cosine) * data.spot_blend, 1e-3), 0.0), 1.0) / (4 * math.pi)

    def irradiance(point: Vector) -> Iterator[tuple[Vector, float, float]]:
        direction, distance = _direction_and_distance(point, pose.translation)
        yield direction, distance, intensity(-axis.dot(direction)) / distance**2

    return irradiance


def _direction_and_distance(origin: Vector, target: Vector) -> tuple[Vector, float]:
    """Unit direction and distance in metres from one point to another."""
    distance = max((target - origin).length, 1e-3)
    return (target - origin) / distance, distance
