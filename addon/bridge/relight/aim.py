"""Where a new light stands: in free space of the room, where it lights best what the camera looks at.

Candidate positions near the one that a preset prefers are scored; the best has free space around it and lights most of
what the picture shows, evenly.
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

CLEARANCE = 0.05
"""Distance that a light keeps from surfaces, metres."""
_CEILING_MARGIN = 0.45
"""Metres below the room's top: a lamp closer to a ceiling overexposes it."""
_UP = Vector((0, 0, 1))
_PROBE_DIRECTIONS = [
    Vector(step).normalized() for step in product((-1, 0, 1), repeat=3) if any(step) and not (step[2] and any(step[:2]))
]


class Placement(NamedTuple):
    """Position, rotation and size in metres of a light, and whether it shines in through an opening."""

    origin: Vector
    rotation: Quaternion
    width: float
    height: float
    outside: bool = False


class Preference(NamedTuple):
    """Where a light would stand in an empty room, relative to its target.

    Azimuth from the camera's direction (to either side) and elevation in degrees; distance from the target and
    clearance in metres.
    """

    side: float
    up: float
    distance: float
    clearance: float


def softbox_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """A key light: to one side of the camera, a little above, with room around it."""
    return _area_light(scene, subject, Preference(40, 35, 2.2, 0.4), 0.9, 0.9)


def spot_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """From above, a little on the camera's side of the target."""
    return _area_light(scene, subject, Preference(0, 60, 2.4, 0.15), 0.2, 0.2)


def window_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """In an opening of the room, else in front of a wall, to the side; the one that lights most of the picture."""
    low, high = bounds(scene)
    room_height, start = high.z - low.z, _in_front_of(scene, subject.target)
    center = Vector((start.x, start.y, low.z + min(1.5, 0.58 * room_height)))
    best_score, opening = 0.0, None
    for side in (sign * side for side in range(30, 151, 15) for sign in (1, -1)):
        direction = _rotated(-view_direction(scene), side, 0)
        hit, wall = cast(scene, center, direction), _exit_distance(center, direction, low, high)
        distance = (min(hit.distance, wall) if hit else wall) - CLEARANCE
        if distance < 0.6 * wall:
            continue  # in front of a cupboard: the light has to stand near the room's edge
        position, inward = center + direction * distance, -direction
        if hit and abs(hit.normal.z) < 0.5:
            inward = Vector((*hit.normal.xy, 0)).normalized()
        is_opening = hit is None or leaves(scene, center, direction)
        score = _illumination(scene, subject, position, inward) * (1.5 if is_opening else 1.0)
        if score > best_score:
            best_score, opening = score, (position, inward)
    if opening is None:  # a room too narrow for any of it
        return softbox_place(scene, subject)
    position, inward = opening
    dimensions = []
    for axis, wanted_size in ((inward.cross(_UP), 1.2), (_UP, min(1.3, 0.55 * room_height))):
        free_distance = min(_free_distance(scene, position, axis * sign, wanted_size / 2) for sign in (1, -1))
        dimensions.append(max(2 * (free_distance - (CLEARANCE if free_distance < wanted_size / 2 else 0.0)), 0.3))
    return Placement(position, _rotation_towards(inward), *dimensions)


def sun_place(scene: bpy.types.Scene, subject: Subject) -> Placement:
    """Low and from the side: through an opening as a sun, else a parallel beam as through a window."""
    best_share, sun_direction = 0.02, None
    # Without a roof a sun would light all of the room and not come in through an opening.
    if cast(scene, _in_front_of(scene, subject.target), _UP) is not None:
        starts = [Vector(p) + 0.02 * Vector(n) for p, n in zip(subject.points, subject.normals, strict=True)]
        for up, side in product((14, 22, 30, 38), range(15, 346, 15)):
            direction = _rotated(-view_direction(scene), side, up)
            shares = subject.weights * (subject.normals @ np.array(direction))
            lit = (k for k in range(0, len(starts), 2) if shares[k] > 0 and leaves(scene, starts[k], direction))
            visible_share = sum(shares[k] for k in lit)
            if visible_share > best_share:
                best_share, sun_direction = visible_share, direction
    if sun_direction is None:
        return _area_light(scene, subject, Preference(75, 16, 3.2, 0.25), 0.9, 1.1)
    origin = subject.target + sun_direction * (_exit_distance(subject.target, sun_direction, *bounds(scene)) + 1.0)
    return Placement(origin, _rotation_towards(-sun_direction), 1.0, 1.2, outside=True)


def _area_light(scene, subject: Subject, preference: Preference, width: float, height: float) -> Placement:
    """An area light of at most that size at the best position, limited by the clearance and the distance."""
    position = _best_position(scene, subject, preference)
    to_target = subject.target - position
    max_size = min(1.6 * _clearance(scene, position, 0.6), 0.5 * max(to_target.length, 0.6))
    return Placement(position, _rotation_towards(to_target), min(width, max_size), min(height, max_size))


def _best_position(scene, subject: Subject, preference: Preference) -> Vector:
    """The position that lights the subject best, weighted by its clearance and how near it is to the preference."""
    top = bounds(scene)[1].z - _CEILING_MARGIN
    best_score, best_position = 0.0, None
    for position, weight in _candidates(scene, subject, preference):
        to_target = subject.target - position
        weight *= min(2 * to_target.length / preference.distance, 1.0) ** 2
        weight *= 0.3 + 0.7 * _clearance(scene, position, preference.clearance) / preference.clearance
        weight *= min(1.0, max(0.2, 1 - 2 * (position.z - top) / _CEILING_MARGIN))
        score = weight * _illumination(scene, subject, position, to_target.normalized()) if weight > best_score else 0.0
        if score > best_score:
            best_score, best_position = score, position
    if best_position is None:  # nowhere is free space: on the camera's side of the target
        direction = (_in_front_of(scene, subject.target) - subject.target).normalized() or _UP
        return subject.target + direction * _usable_distance(scene, subject.target, direction, preference.distance / 2)
    return best_position


def _candidates(scene, subject: Subject, preference: Preference) -> Iterator[tuple[Vector, float]]:
    """Positions with weights, 0...1: around the target, and beside the camera, which stands in free space."""
    camera = -view_direction(scene)
    for up, turn, sign in product((1.0, 0.6, 1.4), (0, -20, 20, 35), (1, -1)):
        direction = _rotated(camera, sign * (preference.side + turn), min(preference.up * up, 80))
        weight = direction.dot(_rotated(camera, sign * preference.side, preference.up))
        free_distance = _usable_distance(scene, subject.target, direction, preference.distance)
        for share in (1.0, 0.7, 0.45):
            if share * preference.distance <= free_distance:
                yield subject.target + direction * share * preference.distance, weight
    if scene.camera is not None:
        eye, right = scene.camera.matrix_world.translation, _UP.cross(camera)
        for step in (right * across + 0.4 * abs(across) * _UP for across in (0.9, -0.9, 0.5, -0.5, 0.0)):
            if _free_distance(scene, eye, step, step.length + 0.2) > step.length:
                yield eye + step, 0.8


def _illumination(scene, subject: Subject, position: Vector, axis: Vector) -> float:
    """How much of the picture a lamp at `position` lights, and how evenly, at most 1."""
    directions = np.array(position) - subject.points
    distances = np.maximum(np.linalg.norm(directions, axis=1), 0.05)
    directions /= distances[:, None]
    incidence = np.maximum((directions * subject.normals).sum(1), 0)
    irradiance = incidence * np.maximum(-directions @ np.array(axis), 0) / distances**2
    for k in np.flatnonzero(irradiance > 0):
        if _free_distance(scene, position, -Vector(directions[k]), distances[k]) < distances[k] - 0.03:
            irradiance[k] = 0.0
    relative = irradiance * max((Vector(position) - subject.target).length, 0.3) ** 2
    return float(subject.weights @ (np.minimum(relative, 1.0) - 0.1 * np.clip(relative - 2.0, 0.0, 5.0)))


def _free_distance(scene, position: Vector, direction: Vector, limit: float) -> float:
    """Metres to the first surface along a ray, at most `limit`."""
    hit = cast(scene, position, direction, limit)
    return hit.distance if hit else limit


def _clearance(scene, position: Vector, limit: float) -> float:
    """Metres to the nearest surface, at most `limit`; 0 outside the room."""
    low, high = bounds(scene)
    if any(not low[k] + CLEARANCE <= position[k] <= high[k] - CLEARANCE for k in range(3)):
        return 0.0
    return min(_free_distance(scene, position, direction, limit) for direction in _PROBE_DIRECTIONS)


def _in_front_of(scene, target: Vector) -> Vector:
    """A point in front of the target, on the camera's side: at the target itself a ray might start within a wall."""
    if scene.camera is None:
        return target
    to_camera = picture_ray(scene)[0] - target
    return target + to_camera * min(0.6 / max(to_camera.length, 1e-6), 0.5)


def _rotated(direction: Vector, side: float, up: float) -> Vector:
    """A horizontal direction rotated by `side` degrees about +Z and raised by `up` degrees."""
    rotated = Matrix.Rotation(math.radians(side), 3, "Z") @ direction
    return rotated * math.cos(math.radians(up)) + _UP * math.sin(math.radians(up))


def _usable_distance(scene, target: Vector, direction: Vector, limit: float) -> float:
    """How far from the target a light may stand: `limit`, but inside the room and in front of any surface."""
    start, wall = target + direction * 0.02, _exit_distance(target, direction, *bounds(scene))
    free_distance = _free_distance(scene, start, direction, wall)
    return max(min(limit, 0.9 * free_distance, free_distance - CLEARANCE), 0.1)


def _exit_distance(position: Vector, direction: Vector, low: Vector, high: Vector) -> float:
    """Distance along a ray from inside a box to its side; 0 from outside."""
    sides = ((k, high if direction[k] > 0 else low) for k in range(3) if abs(direction[k]) > 1e-9)
    return max(min(((side[k] - position[k]) / direction[k] for k, side in sides), default=0.0), 0.0)


def _rotation_towards(direction: Vector) -> Quaternion:
    """The rotation of a lamp, which emits along -Z, towards `direction`, with its Y axis up."""
    return direction.to_track_quat("-Z", "Y")
