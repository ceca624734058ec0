"""What the camera looks at, as points on the room's surfaces: objects in the middle of its picture, or all of it."""

import math
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ..custom_properties import OBJECT_ID
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

_OBJECT_SHARE = 0.05
"""Weighted share of the picture from which on a single object is its subject."""
_SHELL_DEPTH = 0.3, 0.1
"""Metres by which an object protrudes from the walls, and from the floor, if it is not part of them."""


@dataclass(frozen=True)
class Subject:
    """What a light is aimed at and has to light.

    Attributes
    ----------
    target, radius
        Point that the light is aimed at, and how far around it belongs to it; metres.
    name : str
        Of the object; '' where it is the whole view.
    points, normals : (n, 3) float64
        Surface points that the picture shows, metres, and their normals.
    weights : (n,) float64
        Weight of each point; their sum is 1.
    """

    target: Vector
    name: str
    points: np.ndarray
    normals: np.ndarray
    weights: np.ndarray
    radius: float


def subject_of(scene: bpy.types.Scene, aim: str, obj: bpy.types.Object | None = None) -> Subject:
    """The subject of a light aimed by `aim`; see `light.room.target_of`, also for the `BadInputError` it raises."""
    hits = _visible_hits(scene)
    if not hits or aim in (CURSOR, OBJECT):
        target = target_of(scene, aim, obj)
        name, radius = (obj.name, max(obj.dimensions) / 2) if aim == OBJECT else ("", 0.5)
        counts = [5.0 if (hit.location - target).length < max(radius, 0.5) else 1.0 for hit in hits]
    else:
        shell, shares = _shell(scene), {"": _OBJECT_SHARE * sum(hits.values())}
        for hit, weight in hits.items():
            if hit.obj.name not in shell:
                shares[hit.obj.name] = shares.get(hit.obj.name, 0.0) + weight
        name = max(shares, key=shares.get)
        # A ceiling is seldom the subject of a picture.
        counts = [4.0 if hit.obj.name == name else 0.25 if hit.normal.z < -0.7 else 1.0 for hit in hits]
        counted = {hit: count for hit, count in zip(hits, counts) if not name or hit.obj.name == name}
        positions = np.array([hit.location for hit in counted])
        center = np.average(positions, axis=0, weights=[count * hits[hit] for hit, count in counted.items()])
        distances = np.linalg.norm(positions - center, axis=1)
        target, radius = Vector(positions[distances.argmin()]), float(np.quantile(distances, 0.8))
    if not hits:
        return Subject(target, name, np.array([target]), np.array([(0.0, 0.0, 1.0)]), np.ones(1), radius)
    points, normals = (np.array([getattr(hit, field) for hit in hits]) for field in ("location", "normal"))
    weights = np.array(counts) * list(hits.values())
    return Subject(target, name, points, normals, weights / weights.sum(), min(max(radius, 0.2), 1.5))


def _visible_hits(scene) -> dict[Hit, float]:
    """Hits of a grid of rays through the picture, with weights: the middle counts more than the rim."""
    weights: dict[Hit, float] = {}
    for x, y in PICTURE if scene.camera is not None else ():
        hit = cast(scene, *picture_ray(scene, x, y))
        if hit is not None and OBJECT_ID in hit.obj:
            hashable = hit._replace(location=hit.location.freeze(), normal=hit.normal.freeze())
            weights[hashable] = math.exp(-((x - 0.5) ** 2 + (y - 0.5) ** 2) / (2 * 0.3**2))
    return weights


def _shell(scene) -> set[str]:
    """Names of the scanned objects that make up the room itself.

    Those as wide as most of it, above head height, or close to its walls or its floor, such as panels, doors and
    cupboards in an alcove.
    """
    low, high = (np.array(corner) for corner in bounds(scene))
    size, boxes = high - low, {}
    for obj in room_objects(scene):
        corners = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box])
        boxes[obj.name] = corners.min(0), corners.max(0)
    # Objects behind the walls, such as alcoves and panes, extend the room's bounds; walls all around do not.
    walls = [box for box in boxes.values() if all(box[1] - box[0] > 0.6 * size)] or [(low, high)]
    inner, outer = np.maximum.reduce([box[0] for box in walls]), np.minimum.reduce([box[1] for box in walls])
    wall, floor = min(_SHELL_DEPTH[0], 0.1 * min(size[:2])), min(_SHELL_DEPTH[1], 0.1 * size[2])

    def is_shell(minimum: np.ndarray, maximum: np.ndarray) -> bool:
        spans, protrusion = sum(maximum - minimum > 0.6 * size) > 1, min(*(maximum - inner)[:2], *(outer - minimum)[:2])
        return spans or protrusion < wall or maximum[2] - low[2] < floor or minimum[2] > low[2] + 0.85 * size[2]

    return {name for name, box in boxes.items() if is_shell(*box)}


def side_of(scene: bpy.types.Scene, target: Vector, place: Vector) -> str:
    """The side that a light comes from, as seen through the camera."""
    forward, offset = view_direction(scene), place - target
    ahead, right = offset.dot(forward), offset.x * forward.y - offset.y * forward.x
    if offset.length and offset.z > 0.8 * offset.length:
        return "above"
    if abs(right) <= 0.35 * math.hypot(ahead, right):
        return "the camera's side" if ahead <= 0 else "behind"
    return "the right" if right > 0 else "the left"
