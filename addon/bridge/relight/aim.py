"""Where a new light stands: in free space of the room, where it lights best what the camera looks at.

Places are tried out, not drawn: each candidate has room around it, and of those the one is taken that lights most of
what the picture shows, evenly, and from a side that gives it shape.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

from ..light.room import bounds, cast, leaves, picture_ray, view_direction
from .subject import Subject

_CLEAR = 0.05
"""Metres that a light keeps off what is behind it."""
_OFF_CEILING = 0.45
"""Metres below the room's top: a lamp closer to a ceiling burns its edge into it."""
_AROUND = [
    Vector(one).normalized()
    for one in product((-1, 0, 1), repeat=3)
    if any(one) and (not one[2] or not any(one[:2]))  # level, straight up, straight down
]
_ALMOST = 0.03
"""Metres by which a ray may end before a point and still count as reaching it."""


class Placement(NamedTuple):
    """Where a light is, how it is turned, its size in metres, and whether it shines in through an opening."""

    origin: Vector
    rotation: Quaternion
    width: float
    height: float
    outside: bool = False


def softbox_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """A key light: to one side of the camera, a little above, with room around it."""
    place = _best(
        scene, subject, _around(scene, subject, (40, -40, 60, -60, 25, -25), (35, 20, 50), (2.2, 1.6, 1.1)), 0.4, 1.6
    )
    distance = (subject.target - place).length
    room = _room_around(scene, place, 0.6)
    edge = min(max(0.4 * distance, 0.3), 0.9, 1.6 * room)
    return Placement(place, _facing(subject.target - place), edge, edge)


def spot_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """From above, a little on the camera's side of the target."""
    place = _best(
        scene, subject, _around(scene, subject, (0, 35, -35, 60, -60), (60, 72, 45), (2.4, 1.8, 1.2)), 0.15, 1.0
    )
    return Placement(place, _facing(subject.target - place), 0.2, 0.2)


def window_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """In an opening of the room, else before a wall, to the side; what lights most of the picture."""
    low, high = bounds(scene)
    storey = high.z - low.z
    height = min(1.3, 0.55 * storey)
    stand = _before(scene, subject.target)
    middle = Vector((stand.x, stand.y, low.z + min(1.5, 0.58 * storey)))
    best = None
    for side in range(-150, 151, 15):
        if abs(side) < 30:
            continue  # behind the target: it would look into the camera
        direction = _towards(-view_direction(scene), side, 0)
        hit = cast(scene, middle, direction)
        exit_at = _exit(middle, direction, low, high)
        distance = (min(hit.distance, exit_at) if hit else exit_at) - _CLEAR
        if distance < 0.6:
            continue
        inward = -direction
        if hit and abs(hit.normal.z) < 0.5:
            inward = Vector((hit.normal.x, hit.normal.y, 0)).normalized()
        place = middle + direction * distance
        # A wall, not a cupboard: something upright that stands near the room's edge.
        wall = hit is None or distance > 0.6 * exit_at
        opening = hit is None or leaves(scene, middle, direction)
        score = _score(scene, subject, place, inward) * (1.0 if wall else 0.6) * (1.5 if opening else 1.0)
        score *= 0.6 + 0.4 * abs(math.sin(math.radians(side)))
        if best is None or score > best[0]:
            best = score, place, inward
    if best is None:  # a room too narrow for any of it
        return softbox_place(scene, subject)
    _, place, inward = best
    width, tall = _fitting(scene, place, inward, 1.2, height)
    return Placement(place, _facing(inward), width, tall)


def sun_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """Low and from the side: through an opening as a sun, else a parallel beam as a window would let it in."""
    low, high = bounds(scene)
    best = None
    starts = [Vector(p) + 0.02 * Vector(n) for p, n in zip(subject.points, subject.normals, strict=True)]
    # Without a roof a sun would light all of the room and not come in through an opening.
    if cast(scene, _before(scene, subject.target), Vector((0, 0, 1))) is not None:
        for up in (14, 22, 30, 38):
            for side in range(-150, 180, 15):
                if abs(side) < 15:
                    continue
                direction = _towards(-view_direction(scene), side, up)
                cosine = np.maximum(subject.normals @ np.array(direction), 0.0)
                through = sum(
                    subject.weights[k] * cosine[k]
                    for k in range(0, len(starts), 2)
                    if cosine[k] > 0.05 and leaves(scene, starts[k], direction)
                )
                if best is None or through > best[0]:
                    best = through, direction
    if best is not None and best[0] > 0.02:
        direction = best[1]
        origin = subject.target + direction * (_exit(subject.target, direction, low, high) + 1.0)
        return Placement(origin, _facing(-direction), 1.0, 1.2, outside=True)
    place = _best(
        scene, subject, _around(scene, subject, (75, -75, 100, -100, 50, -50), (16, 24, 10), (3.2, 2.2, 1.4)), 0.25, 1.2
    )
    distance = (subject.target - place).length
    room = _room_around(scene, place, 0.6)
    return Placement(
        place, _facing(subject.target - place), *(min(edge, 1.8 * room, 0.5 * distance) for edge in (0.9, 1.1))
    )


def _around(scene, subject: Subject, sides, ups, distances) -> Iterator[tuple[Vector, float]]:
    """Candidates with how well they lie, 0...1: around the target, and around the camera, which stands free."""
    towards_camera = -view_direction(scene)
    for k, side in enumerate(sides):
        for j, up in enumerate(ups):
            direction = _towards(towards_camera, side, up)
            free = _free(scene, subject.target, direction, max(distances))
            for distance in distances:
                if distance <= free:
                    yield subject.target + direction * distance, 1.0 - 0.04 * (k // 2) - 0.05 * j
    if scene.camera is not None:
        eye, forward = scene.camera.matrix_world.translation, view_direction(scene)
        right = Vector((forward.y, -forward.x, 0))
        for across, up in ((0.9, 0.4), (-0.9, 0.4), (0.5, 0.2), (-0.5, 0.2), (0.0, 0.3), (0.0, 0.0)):
            step = right * across + Vector((0, 0, up))
            hit = cast(scene, eye, step) if step.length else None
            if hit is None or hit.distance > step.length + 0.2:
                yield eye + step, 0.75 + 0.1 * abs(across)


def _best(scene, subject: Subject, candidates: Iterator[tuple[Vector, float]], room: float, near: float) -> Vector:
    """The candidate that lights the subject best; `room` metres around it and `near` metres from it are wanted."""
    top = bounds(scene)[1].z - _OFF_CEILING
    best = None
    for place, liking in candidates:
        way = subject.target - place
        liking *= min(way.length / near, 1.0) ** 2 * (0.3 + 0.7 * min(_room_around(scene, place, room) / room, 1.0))
        liking *= 1.0 if place.z <= top else max(0.2, 1 - 2 * (place.z - top) / _OFF_CEILING)
        score = liking * _score(scene, subject, place, way.normalized())
        if best is None or score > best[0]:
            best = score, place
    if best is None or best[0] <= 0:  # nothing has any room: on the camera's side of the target
        direction = (_before(scene, subject.target) - subject.target).normalized() or Vector((0, 0, 1))
        return subject.target + direction * _free(scene, subject.target, direction, near)
    return best[1]


def _score(scene, subject: Subject, place: Vector, shines: Vector) -> float:
    """How much of the picture a lamp at `place` lights, and how evenly, 0...1."""
    ways = np.array(place) - subject.points
    distances = np.maximum(np.linalg.norm(ways, axis=1), 0.05)
    ways /= distances[:, None]
    light = np.maximum((ways * subject.normals).sum(1), 0) * np.maximum(-ways @ np.array(shines), 0) / distances**2
    for k in np.flatnonzero(light > 0):
        hit = cast(scene, place, -Vector(ways[k]))
        if hit is not None and hit.distance < distances[k] - _ALMOST:
            light[k] = 0.0
    full = 1 / max((Vector(place) - subject.target).length, 0.3) ** 2
    got = light / full
    return float(subject.weights @ (np.minimum(got, 1.0) - 0.1 * np.minimum(np.maximum(got - 2.0, 0.0), 5.0)))


def _room_around(scene, place: Vector, wanted: float) -> float:
    """Metres to the nearest surface, at most `wanted`; 0 outside the room."""
    low, high = bounds(scene)
    if any(not low[k] + _CLEAR <= place[k] <= high[k] - _CLEAR for k in range(3)):
        return 0.0
    hits = [cast(scene, place, direction, wanted) for direction in _AROUND]
    return min((hit.distance for hit in hits if hit), default=wanted)


def _fitting(scene, place: Vector, inward: Vector, width: float, height: float) -> tuple[float, float]:
    """A sheet's size about `place` that meets nothing."""
    right = Vector((inward.y, -inward.x, 0))
    sizes = []
    for axis, wanted in ((right, width), (Vector((0, 0, 1)), height)):
        hits = [cast(scene, place, axis * sign, wanted / 2) for sign in (1, -1)]
        free = min((hit.distance for hit in hits if hit), default=wanted / 2)
        sizes.append(max(2 * (free - (_CLEAR if free < wanted / 2 else 0.0)), 0.3))
    return tuple(sizes)


def _before(scene, target: Vector) -> Vector:
    """A place in front of the target, on the camera's side: on the target itself a ray might start within a wall."""
    if scene.camera is None:
        return target
    way = picture_ray(scene)[0] - target
    return target + way * min(0.6 / max(way.length, 1e-6), 0.5)


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
    ways = [
        ((high if direction[k] > 0 else low)[k] - place[k]) / direction[k] for k in range(3) if abs(direction[k]) > 1e-9
    ]
    return max(min(ways, default=0.0), 0.0)


def _facing(direction: Vector) -> Quaternion:
    """The rotation that turns a lamp, which shines along -Z, towards `direction`, its own Y up."""
    return direction.to_track_quat("-Z", "Y")
