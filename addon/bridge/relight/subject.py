"""What the camera looks at, as points on the room's surfaces: the things in the middle of its picture, or all of it."""

import math
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ..light.room import (
    CURSOR,
    OBJECT,
    PICTURE,
    Hit,
    bounds,
    cast,
    picture_ray,
    room_objects,
    target_of,
    view_direction,
)
from ..marks import OBJECT_ID

_THING = 0.05
"""Weighted share of the picture from which on a single thing is what the picture is of."""
_STANDS_OUT = 0.3, 0.1
"""Metres by which a thing stands out from the walls, and from the floor, if it is more than a part of them."""


@dataclass(frozen=True)
class Subject:
    """What a light is for.

    Attributes
    ----------
    target : Vector
        What it is aimed at, metres.
    name : str
        Of the thing; '' where it is the view as a whole.
    points, normals : (n, 3) float64
        What else the picture shows, metres.
    weights : (n,) float64
        How much each counts; their sum is 1.
    radius : float
        Metres around the target that belong to it.
    """

    target: Vector
    name: str
    points: np.ndarray
    normals: np.ndarray
    weights: np.ndarray
    radius: float


def subject_of(scene: bpy.types.Scene, aim: str, thing: bpy.types.Object | None = None) -> Subject:
    """What a light that is aimed by `aim` (see `light.room.target_of`) is for; raises `BadInputError` as that."""
    seen = _seen(scene)
    if not seen or aim in (CURSOR, OBJECT):
        target = target_of(scene, aim, thing)
        name, radius = (thing.name, max(thing.dimensions) / 2) if aim == OBJECT else ("", 0.5)
        counts = [5.0 if (hit.place - target).length < max(radius, 0.5) else 1.0 for hit in seen]
    else:
        shell, shares = _shell(scene), {"": _THING * sum(seen.values())}
        for hit, weight in seen.items():
            if hit.thing.name not in shell:
                shares[hit.thing.name] = shares.get(hit.thing.name, 0.0) + weight
        name = max(shares, key=shares.get)
        # A ceiling is seldom what a picture is of.
        counts = [4.0 if hit.thing.name == name else 0.25 if hit.normal.z < -0.7 else 1.0 for hit in seen]
        of = {hit: count for hit, count in zip(seen, counts) if not name or hit.thing.name == name}
        places = np.array([hit.place for hit in of])
        middle = np.average(places, axis=0, weights=[count * seen[hit] for hit, count in of.items()])
        beside = np.linalg.norm(places - middle, axis=1)
        target, radius = Vector(places[beside.argmin()]), float(np.quantile(beside, 0.8))
    if not seen:
        return Subject(target, name, np.array([target]), np.array([(0.0, 0.0, 1.0)]), np.ones(1), radius)
    points, normals = (np.array([getattr(hit, field) for hit in seen]) for field in ("place", "normal"))
    weights = np.array(counts) * list(seen.values())
    return Subject(target, name, points, normals, weights / weights.sum(), min(max(radius, 0.2), 1.5))


def _seen(scene) -> dict[Hit, float]:
    """What a grid of the picture's rays meets, and how much each counts: the middle more than the rim."""
    found: dict[Hit, float] = {}
    for x, y in PICTURE if scene.camera is not None else ():
        hit = cast(scene, *picture_ray(scene, x, y))
        if hit is not None and OBJECT_ID in hit.thing:
            found[hit._replace(place=hit.place.freeze(), normal=hit.normal.freeze())] = math.exp(
                -((x - 0.5) ** 2 + (y - 0.5) ** 2) / (2 * 0.3**2)
            )
    return found


def _shell(scene) -> set[str]:
    """Names of the scanned objects that make up the room itself.

    As wide as most of it, above one's head, or all within a hand's breadth of its walls or its floor, as panels,
    doors and cupboards in an alcove are.
    """
    low, high = (np.array(one) for one in bounds(scene))
    size, boxes = high - low, {}
    for thing in room_objects(scene):
        corners = np.array([thing.matrix_world @ Vector(corner) for corner in thing.bound_box])
        boxes[thing.name] = corners.min(0), corners.max(0)
    # What lies behind the walls, as alcoves and panes do, widens the room's bounds: those of walls all around do not.
    walls = [box for box in boxes.values() if all(box[1] - box[0] > 0.6 * size)] or [(low, high)]
    inner, outer = np.maximum.reduce([box[0] for box in walls]), np.minimum.reduce([box[1] for box in walls])
    wall, floor = min(_STANDS_OUT[0], 0.1 * min(size[:2])), min(_STANDS_OUT[1], 0.1 * size[2])

    def is_part(least: np.ndarray, most: np.ndarray) -> bool:
        wide, out = sum(most - least > 0.6 * size) > 1, min(*(most - inner)[:2], *(outer - least)[:2])
        return wide or out < wall or most[2] - low[2] < floor or least[2] > low[2] + 0.85 * size[2]

    return {name for name, box in boxes.items() if is_part(*box)}


def side_of(scene: bpy.types.Scene, target: Vector, place: Vector) -> str:
    """From where a light comes, as who looks through the camera would say it."""
    forward, way = view_direction(scene), place - target
    ahead, right = way.dot(forward), way.x * forward.y - way.y * forward.x
    if way.length and way.z > 0.8 * way.length:
        return "above"
    if abs(right) <= 0.35 * math.hypot(ahead, right):
        return "the camera's side" if ahead <= 0 else "behind"
    return "the right" if right > 0 else "the left"
