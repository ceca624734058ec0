"""Where a new light stands: inside the room, in sight of what it is aimed at, from the side of the camera's view."""

from __future__ import annotations

import math
from typing import NamedTuple

import bpy
from mathutils import Matrix, Quaternion, Vector

from .relight_room import bounds, cast, leaves, view_direction

_CLEAR = 0.05
"""Metres that a light keeps off what is behind it."""


_NEAR = 0.8
"""Metres from its target from which on a light lights more than that."""


class Placement(NamedTuple):
    """Where a light is, how it is turned, its size in metres, and whether it shines in through an opening."""

    origin: Vector
    rotation: Quaternion
    width: float
    height: float
    outside: bool = False


def softbox_place(scene: bpy.types.Scene, target: Vector, ignored: bpy.types.Object | None) -> Placement:
    """A key light: beside the camera, 40 degrees up, where there is most room for it."""
    best = None
    for side in (50, -50, 25, -25, 80, -80):
        for up in (40, 25, 55):
            direction = _towards(-view_direction(scene), side, up)
            distance = _free(scene, target, direction, 1.8)
            if best is None or distance > best[0] + 0.2:
                best = distance, direction
    distance, direction = _from_camera(scene, target, *best)
    edge = min(max(0.4 * distance, 0.15), 0.8)
    return Placement(target + direction * distance, _facing(-direction), edge, edge)


def spot_place(scene: bpy.types.Scene, target: Vector, ignored: bpy.types.Object | None) -> Placement:
    """Under the ceiling, a little on the camera's side of the target."""
    up = max((_towards(-view_direction(scene), side, elevation) for side in (0, 35, -35) for elevation in (65, 80)),
             key=lambda direction: _free(scene, target, direction, 2.2))
    distance, up = _from_camera(scene, target, _free(scene, target, up, 2.2), up)
    return Placement(target + up * distance, _facing(-up), 0.08, 0.08)


def window_place(scene: bpy.types.Scene, target: Vector, ignored: bpy.types.Object | None) -> Placement:
    """In an opening of the room to the side, else before the wall at the side that is in sight and farthest."""
    low, high = bounds(scene)
    storey = high.z - low.z
    height = min(1.3, 0.55 * storey)
    stand = _before(scene, target)
    middle = Vector((stand.x, stand.y, low.z + min(1.5, 0.58 * storey)))
    best = None
    for side in (90, -90, 75, -75, 105, -105, 60, -60, 120, -120):
        direction = _towards(-view_direction(scene), side, 0)
        hit = cast(scene, middle, direction)
        exit_at = _exit(middle, direction, low, high)
        # A wall, not a cupboard: something upright that stands near the room's edge.
        distance = hit.distance if hit else exit_at
        rank = (hit is None, distance > 0.6 * exit_at, min(distance, 3.0) - 0.01 * abs(abs(side) - 90))
        if best is None or rank > best[0]:
            best = rank, direction, hit, exit_at
    _, direction, hit, exit_at = best
    inward = -direction
    if hit and abs(hit.normal.z) < 0.5:
        inward = Vector((hit.normal.x, hit.normal.y, 0)).normalized()
    distance = (hit.distance if hit else exit_at) - _CLEAR
    return Placement(middle + direction * max(distance, 0.2), _facing(inward), 1.2, height)


def sun_place(scene: bpy.types.Scene, target: Vector, ignored: bpy.types.Object | None) -> Placement:
    """Low and from the side: through an opening as a sun, else a parallel beam as a window would let it in."""
    low, high = bounds(scene)
    beside = (-100, 100, -75, 75, -125, 125, -50, 50, 150, -150)
    above = target + Vector((0, 0, _CLEAR))
    for up in (14, 20, 28, 36):
        for side in beside:
            direction = _towards(-view_direction(scene), side, up)
            if leaves(scene, above, direction) and _is_enclosed(scene, above):
                origin = above + direction * (_exit(above, direction, low, high) + 1.0)
                return Placement(origin, _facing(-direction), 1.0, 1.2, outside=True)
    direction = max((_towards(-view_direction(scene), side, up) for side in beside[:6] for up in (16, 24)),
                    key=lambda d: _free(scene, above, d, 6.0))
    distance, direction = _from_camera(scene, above, _free(scene, above, direction, 6.0), direction)
    width, height = min(0.9, 0.5 * distance), min(1.1, 0.6 * distance)
    origin = above + direction * distance
    return Placement(origin, _facing(target - origin), width, height)


def _from_camera(scene, target: Vector, distance: float, direction: Vector) -> tuple[float, Vector]:
    """Distance and direction of a light; from the camera, which sees the target, where all else is too close to it.

    A light in a corner, a hand's breadth from its target, would leave the rest of the room black.
    """
    if distance >= _NEAR or scene.camera is None:
        return distance, direction
    way = scene.camera.matrix_world.translation - target
    if way.length <= distance:
        return distance, direction
    return _free(scene, target, way.normalized(), way.length), way.normalized()


def _before(scene, target: Vector) -> Vector:
    """A place in front of the target, on the camera's side: on the target itself a ray might start within a wall."""
    if scene.camera is None:
        return target
    way = scene.camera.matrix_world.translation - target
    return target + way * min(0.6 / max(way.length, 1e-6), 0.5)


def _is_enclosed(scene, place: Vector) -> bool:
    """Whether a place has a roof: else a sun would light all of the room and not come in through an opening."""
    return cast(scene, place, Vector((0, 0, 1))) is not None


def _towards(level: Vector, side: float, up: float) -> Vector:
    """A level direction turned by `side` degrees about +Z and raised by `up` degrees."""
    turned = Matrix.Rotation(math.radians(side), 3, "Z") @ level
    return turned * math.cos(math.radians(up)) + Vector((0, 0, math.sin(math.radians(up))))


def _free(scene, target: Vector, direction: Vector, wanted: float) -> float:
    """How far from the target a light may stand: `wanted`, but inside the room and clear of what is in the way."""
    low, high = bounds(scene)
    start = target + direction * 0.02
    hit = cast(scene, start, direction)
    limit = min(hit.distance if hit else math.inf, _exit(target, direction, low, high))
    return max(min(wanted, limit * 0.9, limit - _CLEAR), 0.1)


def _exit(place: Vector, direction: Vector, low: Vector, high: Vector) -> float:
    """Distance along a ray from within a box to its side; 0 from without."""
    ways = [((high if direction[k] > 0 else low)[k] - place[k]) / direction[k] for k in range(3)
            if abs(direction[k]) > 1e-9]
    return max(min(ways, default=0.0), 0.0)


def _facing(direction: Vector) -> Quaternion:
    """The rotation that turns a lamp, which shines along -Z, towards `direction`, its own Y up."""
    return direction.to_track_quat("-Z", "Y")
