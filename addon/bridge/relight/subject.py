"""What the camera looks at, as points on the room's surfaces: the things in the middle of its picture, or all of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ..light.room import CURSOR, OBJECT, Hit, bounds, cast, picture_ray, target_of, view_direction
from ..marks import OBJECT_ID

_GRID = 11
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
    hits, weights = _seen(scene)
    if not hits or aim in (CURSOR, OBJECT):
        target = target_of(scene, aim, thing)
        name, radius = (thing.name, max(thing.dimensions) / 2) if aim == OBJECT else ("", 0.5)
        near = np.array([1.0 + 4.0 * ((hit.place - target).length < max(radius, 0.5)) for hit in hits]) * weights
        return _subject(target, name, hits, near, radius)
    shell = _shell(scene)
    shares: dict[str, float] = {}
    for hit, weight in zip(hits, weights, strict=True):
        if hit.thing.name not in shell:
            shares[hit.thing.name] = shares.get(hit.thing.name, 0.0) + weight
    name = max(shares, key=shares.get, default="")
    if not name or shares[name] < _THING * weights.sum():
        name = ""
    # A ceiling is seldom what a picture is of.
    counts = np.array(
        [
            weight * (4.0 if hit.thing.name == name else 0.25 if hit.normal.z < -0.7 else 1.0)
            for hit, weight in zip(hits, weights, strict=True)
        ]
    )
    of = [k for k, hit in enumerate(hits) if not name or hit.thing.name == name]
    places = np.array([hits[k].place for k in of])
    middle = np.average(places, axis=0, weights=counts[of])
    nearest = of[int(np.linalg.norm(places - middle, axis=1).argmin())]
    radius = float(np.quantile(np.linalg.norm(places - middle, axis=1), 0.8))
    return _subject(hits[nearest].place, name, hits, counts, radius)


def _subject(target, name, hits: list[Hit], counts: np.ndarray, radius: float) -> Subject:
    if not hits:
        return Subject(target, name, np.array([target]), np.array([(0.0, 0.0, 1.0)]), np.ones(1), radius)
    return Subject(
        target,
        name,
        np.array([hit.place for hit in hits]),
        np.array([hit.normal for hit in hits]),
        counts / counts.sum(),
        min(max(radius, 0.2), 1.5),
    )


def _seen(scene) -> tuple[list[Hit], np.ndarray]:
    """What a grid of the picture's rays meets, and how much each counts: the middle more than the rim."""
    hits, weights = [], []
    if scene.camera is None:
        return hits, np.empty(0)
    for j in range(_GRID):
        for i in range(_GRID):
            x, y = (i + 0.5) / _GRID, (j + 0.5) / _GRID
            hit = cast(scene, *picture_ray(scene, x, y))
            if hit is not None and OBJECT_ID in hit.thing:
                hits.append(hit)
                weights.append(math.exp(-((x - 0.5) ** 2 + (y - 0.5) ** 2) / (2 * 0.3**2)))
    return hits, np.array(weights)


def _shell(scene) -> set[str]:
    """Names of the scanned objects that make up the room itself.

    As wide as most of it, above one's head, or all within a hand's breadth of its walls or its floor, as panels,
    doors and cupboards in an alcove are.
    """
    low, high = (np.array(one) for one in bounds(scene))
    boxes = {
        thing.name: np.array([thing.matrix_world @ Vector(corner) for corner in thing.bound_box])
        for thing in scene.objects
        if OBJECT_ID in thing and thing.type == "MESH"
    }
    boxes = {name: (corners.min(0), corners.max(0)) for name, corners in boxes.items()}
    around = {name for name, (least, most) in boxes.items() if sum(most - least > 0.6 * (high - low)) > 1}
    upright = [box for box in boxes.values() if all(box[1] - box[0] > 0.6 * (high - low))]  # walls all around
    # What lies behind the walls, as alcoves and panes do, widens the room's bounds: the walls' own are narrower.
    inner, outer = (
        (np.maximum.reduce([box[0] for box in upright]), np.minimum.reduce([box[1] for box in upright]))
        if upright
        else (low, high)
    )
    wall, floor = min(_STANDS_OUT[0], 0.1 * min((high - low)[:2])), min(_STANDS_OUT[1], 0.1 * (high - low)[2])

    def is_part(least: np.ndarray, most: np.ndarray) -> bool:
        out = min(*(most - inner)[:2], *(outer - least)[:2])
        return out < wall or most[2] - low[2] < floor or least[2] > low[2] + 0.85 * (high - low)[2]

    return around | {name for name, (least, most) in boxes.items() if is_part(least, most)}


def side_of(scene: bpy.types.Scene, target: Vector, place: Vector) -> str:
    """From where a light comes, as who looks through the camera would say it."""
    forward = view_direction(scene)
    right = Vector((forward.y, -forward.x, 0))
    way = place - target
    level = Vector((way.x, way.y, 0))
    if way.length and way.z > 0.8 * way.length:
        return "above"
    if level.length < 1e-6 or abs(level.dot(right)) < 0.35 * level.length:
        return "the camera's side" if level.dot(forward) <= 0 else "behind"
    return "the right" if level.dot(right) > 0 else "the left"
