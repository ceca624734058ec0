"""Where a new light stands: in free space of the room, where it lights best what the camera looks at.

Places are tried out, not drawn: of those near what a preset wishes for, the one is taken that has room around it and
lights most of what the picture shows, evenly.
"""

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

from ..light.room import bounds, cast, leaves, picture_ray, view_direction
from .subject import Subject

CLEAR = 0.05
"""Metres that a light keeps off what is behind it."""
_OFF_CEILING = 0.45
"""Metres below the room's top: a lamp closer to a ceiling burns its edge into it."""
_UP = Vector((0, 0, 1))
_AROUND = [
    Vector(one).normalized() for one in product((-1, 0, 1), repeat=3) if any(one) and not (one[2] and any(one[:2]))
]


class Placement(NamedTuple):
    """Where a light is, how it is turned, its size in metres, and whether it shines in through an opening."""

    origin: Vector
    rotation: Quaternion
    width: float
    height: float
    outside: bool = False


class Wish(NamedTuple):
    """Where a light would stand in an empty room, seen from its target.

    Degrees beside the camera (to either side) and upwards; metres from the target; metres of free room around it.
    """

    side: float
    up: float
    distance: float
    room: float


def softbox_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """A key light: to one side of the camera, a little above, with room around it."""
    return _sheet(scene, subject, Wish(40, 35, 2.2, 0.4), 0.9, 0.9)


def spot_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """From above, a little on the camera's side of the target."""
    return _sheet(scene, subject, Wish(0, 60, 2.4, 0.15), 0.2, 0.2)


def window_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """In an opening of the room, else before a wall, to the side; what lights most of the picture."""
    low, high = bounds(scene)
    storey, stand = high.z - low.z, _before(scene, subject.target)
    middle = Vector((stand.x, stand.y, low.z + min(1.5, 0.58 * storey)))
    best, found = 0.0, None
    for side in (sign * side for side in range(30, 151, 15) for sign in (1, -1)):
        direction = _towards(-view_direction(scene), side, 0)
        hit, wall = cast(scene, middle, direction), _exit(middle, direction, low, high)
        distance = (min(hit.distance, wall) if hit else wall) - CLEAR
        if distance < 0.6 * wall:
            continue  # before a cupboard: the light has to stand near the room's edge
        place, inward = middle + direction * distance, -direction
        if hit and abs(hit.normal.z) < 0.5:
            inward = Vector((*hit.normal.xy, 0)).normalized()
        score = _lit(scene, subject, place, inward) * (1.5 if hit is None or leaves(scene, middle, direction) else 1.0)
        if score > best:
            best, found = score, (place, inward)
    if found is None:  # a room too narrow for any of it
        return softbox_place(scene, subject)
    place, inward = found
    sizes = []
    for axis, wanted in ((inward.cross(_UP), 1.2), (_UP, min(1.3, 0.55 * storey))):
        free = min(_way(scene, place, axis * sign, wanted / 2) for sign in (1, -1))
        sizes.append(max(2 * (free - (CLEAR if free < wanted / 2 else 0.0)), 0.3))
    return Placement(place, _facing(inward), *sizes)


def sun_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """Low and from the side: through an opening as a sun, else a parallel beam as a window would let it in."""
    best, found = 0.02, None
    # Without a roof a sun would light all of the room and not come in through an opening.
    if cast(scene, _before(scene, subject.target), _UP) is not None:
        starts = [Vector(p) + 0.02 * Vector(n) for p, n in zip(subject.points, subject.normals, strict=True)]
        for up, side in product((14, 22, 30, 38), range(15, 346, 15)):
            direction = _towards(-view_direction(scene), side, up)
            share = subject.weights * (subject.normals @ np.array(direction))
            through = sum(
                share[k] for k in range(0, len(starts), 2) if share[k] > 0 and leaves(scene, starts[k], direction)
            )
            if through > best:
                best, found = through, direction
    if found is None:
        return _sheet(scene, subject, Wish(75, 16, 3.2, 0.25), 0.9, 1.1)
    origin = subject.target + found * (_exit(subject.target, found, *bounds(scene)) + 1.0)
    return Placement(origin, _facing(-found), 1.0, 1.2, outside=True)


def _sheet(scene, subject: Subject, wish: Wish, width: float, height: float) -> Placement:
    """A light of at most that size at the best place, no larger than the room around it and its distance allow."""
    place = _best(scene, subject, wish)
    way = subject.target - place
    most = min(1.6 * _room_around(scene, place, 0.6), 0.5 * max(way.length, 0.6))
    return Placement(place, _facing(way), min(width, most), min(height, most))


def _best(scene, subject: Subject, wish: Wish) -> Vector:
    """The place that lights the subject best, weighed by the room around it and how near it comes to the wish."""
    top = bounds(scene)[1].z - _OFF_CEILING
    best, found = 0.0, None
    for place, liking in _candidates(scene, subject, wish):
        way = subject.target - place
        liking *= min(2 * way.length / wish.distance, 1.0) ** 2
        liking *= 0.3 + 0.7 * _room_around(scene, place, wish.room) / wish.room
        liking *= min(1.0, max(0.2, 1 - 2 * (place.z - top) / _OFF_CEILING))
        score = liking * _lit(scene, subject, place, way.normalized()) if liking > best else 0.0
        if score > best:
            best, found = score, place
    if found is None:  # nothing has any room: on the camera's side of the target
        direction = (_before(scene, subject.target) - subject.target).normalized() or _UP
        return subject.target + direction * _free(scene, subject.target, direction, wish.distance / 2)
    return found


def _candidates(scene, subject: Subject, wish: Wish) -> Iterator[tuple[Vector, float]]:
    """Places with how well they lie, 0...1: around the target, and beside the camera, which stands free."""
    camera = -view_direction(scene)
    for up, turn, sign in product((1.0, 0.6, 1.4), (0, -20, 20, 35), (1, -1)):
        direction = _towards(camera, sign * (wish.side + turn), min(wish.up * up, 80))
        liking = direction.dot(_towards(camera, sign * wish.side, wish.up))
        free = _free(scene, subject.target, direction, wish.distance)
        yield from (
            (subject.target + direction * share * wish.distance, liking)
            for share in (1.0, 0.7, 0.45)
            if share * wish.distance <= free
        )
    if scene.camera is not None:
        eye, right = scene.camera.matrix_world.translation, _UP.cross(camera)
        for step in (right * across + 0.4 * abs(across) * _UP for across in (0.9, -0.9, 0.5, -0.5, 0.0)):
            if _way(scene, eye, step, step.length + 0.2) > step.length:
                yield eye + step, 0.8


def _lit(scene, subject: Subject, place: Vector, shines: Vector) -> float:
    """How much of the picture a lamp at `place` lights, and how evenly, at most 1."""
    ways = np.array(place) - subject.points
    distances = np.maximum(np.linalg.norm(ways, axis=1), 0.05)
    ways /= distances[:, None]
    light = np.maximum((ways * subject.normals).sum(1), 0) * np.maximum(-ways @ np.array(shines), 0) / distances**2
    for k in np.flatnonzero(light > 0):
        if _way(scene, place, -Vector(ways[k]), distances[k]) < distances[k] - 0.03:
            light[k] = 0.0
    got = light * max((Vector(place) - subject.target).length, 0.3) ** 2
    return float(subject.weights @ (np.minimum(got, 1.0) - 0.1 * np.clip(got - 2.0, 0.0, 5.0)))


def _way(scene, place: Vector, direction: Vector, wanted: float) -> float:
    """Metres to the first surface along a ray, at most `wanted`."""
    hit = cast(scene, place, direction, wanted)
    return hit.distance if hit else wanted


def _room_around(scene, place: Vector, wanted: float) -> float:
    """Metres to the nearest surface, at most `wanted`; 0 outside the room."""
    low, high = bounds(scene)
    if any(not low[k] + CLEAR <= place[k] <= high[k] - CLEAR for k in range(3)):
        return 0.0
    return min(_way(scene, place, direction, wanted) for direction in _AROUND)


def _before(scene, target: Vector) -> Vector:
    """A place in front of the target, on the camera's side: on the target itself a ray might start within a wall."""
    if scene.camera is None:
        return target
    way = picture_ray(scene)[0] - target
    return target + way * min(0.6 / max(way.length, 1e-6), 0.5)


def _towards(level: Vector, side: float, up: float) -> Vector:
    """A level direction turned by `side` degrees about +Z and raised by `up` degrees."""
    turned = Matrix.Rotation(math.radians(side), 3, "Z") @ level
    return turned * math.cos(math.radians(up)) + _UP * math.sin(math.radians(up))


def _free(scene, target: Vector, direction: Vector, wanted: float) -> float:
    """How far from the target a light may stand: `wanted`, but inside the room and clear of what is in the way."""
    start, wall = target + direction * 0.02, _exit(target, direction, *bounds(scene))
    limit = _way(scene, start, direction, wall)
    return max(min(wanted, 0.9 * limit, limit - CLEAR), 0.1)


def _exit(place: Vector, direction: Vector, low: Vector, high: Vector) -> float:
    """Distance along a ray from within a box to its side; 0 from without."""
    ways = [
        ((high if direction[k] > 0 else low)[k] - place[k]) / direction[k] for k in range(3) if abs(direction[k]) > 1e-9
    ]
    return max(min(ways, default=0.0), 0.0)


def _facing(direction: Vector) -> Quaternion:
    """The rotation that turns a lamp, which shines along -Z, towards `direction`, its own Y up."""
    return direction.to_track_quat("-Z", "Y")
