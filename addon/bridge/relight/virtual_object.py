"""Things that were not scanned, set onto the room's surfaces; being in the scene, they take and throw its light."""

import math
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...core.errors import BadInputError
from ..data.added import own_collection
from ..data.arrays import vertices_of
from ..data.materials import plain_material
from ..light.room import Hit, bounds, cast, depsgraph_of, picture_ray

KIND = "scan_relight_virtual"
"""Custom property of a thing that was set into the room."""
COLLECTION = "Virtual Objects"
SPHERE, CUBE, MONKEY = "SPHERE", "CUBE", "MONKEY"
SHAPES = (SPHERE, CUBE, MONKEY)
NAMES = {SPHERE: "Sphere", CUBE: "Cube", MONKEY: "Suzanne"}
OWN, MATTE, GLOSSY, MIRROR = "OWN", "MATTE", "GLOSSY", "MIRROR"
LOOKS = {
    MATTE: {"colour": (0.5, 0.5, 0.5), "roughness": 1.0, "specular": 0.0},
    GLOSSY: {"colour": (0.35, 0.02, 0.015), "roughness": 0.15, "specular": 0.5},
    MIRROR: {"colour": (0.95, 0.95, 0.95), "roughness": 0.0, "specular": 0.5, "metallic": 1.0},
}
_UPRIGHT = 0.5
"""Least z of the normal of a surface that a thing can stand on."""
_FLAT = 0.18
"""Metres around a place over which it has to be level to be taken for a floor or a table."""
_PROBES = 400
_DOWN = Vector((0, 0, -1))


def add_virtual(
    scene: bpy.types.Scene, shape: str, size: float = 0.3, look: str = MATTE, at: Hit | None = None
) -> bpy.types.Object:
    """Make a simple thing and stand it on a surface of the room.

    Parameters
    ----------
    shape : str
        One of `SHAPES`.
    size : float
        Largest extent in metres.
    look : str
        One of `LOOKS`.
    at : Hit, optional
        The surface; by default what `place_in_view` finds.

    Raises
    ------
    BadInputError
        No room, or no surface to stand on.
    """
    at = at or place_in_view(scene)
    mesh = bpy.data.meshes.new(NAMES[shape])
    build = bmesh.new()
    if shape == SPHERE:
        bmesh.ops.create_uvsphere(build, u_segments=64, v_segments=32, radius=0.5)
    elif shape == CUBE:
        bmesh.ops.create_cube(build, size=1.0)
    else:
        bmesh.ops.create_monkey(build)
    build.to_mesh(mesh)
    build.free()
    thing = bpy.data.objects.new(NAMES[shape], mesh)
    thing.scale = (size / float(np.ptp(vertices_of(mesh), axis=0).max()),) * 3
    own_collection(scene, COLLECTION).objects.link(thing)
    set_look(thing, look)
    if shape != CUBE:
        mesh.shade_smooth()
    if shape == MONKEY:
        thing.modifiers.new("Smooth", "SUBSURF").render_levels = 2
        if scene.camera:
            way = scene.camera.matrix_world.translation - at.place
            thing.rotation_euler.z = math.atan2(way.y, way.x) + math.pi / 2
    stand(scene, thing, at)
    return thing


def set_look(thing: bpy.types.Object, look: str) -> None:
    """Give a thing one of the materials of `LOOKS`; `OWN` leaves what it wears."""
    if look == OWN:
        return
    name = f"Scan Relight {look.lower()}"
    material = bpy.data.materials.get(name) or plain_material(name, **LOOKS[look])
    thing.data.materials.clear()
    thing.data.materials.append(material)


def stand(scene: bpy.types.Scene, thing: bpy.types.Object, at: Hit | None = None) -> None:
    """Set an object onto a surface of the room: clear of the walls, let down until it touches.

    Parameters
    ----------
    thing : bpy.types.Object
        Its rotation and scale stay.
    at : Hit, optional
        The surface; by default what `place_in_view` finds. An upright one means the surface below, before it.

    Raises
    ------
    BadInputError
        There is no surface below.
    """
    at = at or place_in_view(scene, thing)
    corners = np.array([thing.matrix_world @ Vector(corner) for corner in thing.bound_box])
    if thing.type == "MESH":  # all of its vertices, modifiers and all
        evaluated = thing.evaluated_get(depsgraph_of(scene))
        corners = vertices_of(evaluated.data, evaluated.matrix_world)
    with _hidden(thing):  # else it would stand on itself
        low, high = corners.min(0), corners.max(0)
        pivot = Vector((*((low + high) / 2)[:2], low[2]))
        radius = float(np.linalg.norm(corners[:, :2] - np.array(pivot[:2]), axis=1).max())
        place = at.place
        if at.normal.z < _UPRIGHT:
            below = cast(scene, place + at.normal * (radius + 0.01), _DOWN)
            if below is None:
                raise BadInputError("There is no surface below that place to stand on; choose a floor or a table top.")
            place = below.place
        place = _clear_of_walls(scene, place, radius, float(high[2] - low[2]))
        shift = place - pivot
        shift.z -= _drop(scene, corners + np.array(shift), place.z)
    if thing.parent:
        thing.matrix_world = Matrix.Translation(shift) @ thing.matrix_world
    else:
        thing.location += shift
    thing[KIND] = True
    depsgraph_of(scene)


@contextmanager
def _hidden(thing: bpy.types.Object) -> Iterator[None]:
    """Within: no ray meets an object."""
    hidden = thing.hide_viewport
    try:
        thing.hide_viewport = True
        yield
    finally:
        thing.hide_viewport = hidden


def place_in_view(scene: bpy.types.Scene, ignored: bpy.types.Object | None = None) -> Hit:
    """The surface to stand on that is nearest the picture's middle, else below the 3D cursor or the room's middle."""
    with _hidden(ignored) if ignored is not None else nullcontext():
        low, high = bounds(scene)
        starts = [scene.cursor.location + Vector((0, 0, 0.05)), (low + high) / 2]
        if scene.camera:
            if seen := _flat_in_view(scene):
                return seen
            origin, direction = picture_ray(scene)
            if hit := cast(scene, origin, direction):
                starts.insert(0, hit.place - direction * min(0.8, 0.4 * hit.distance))
        for start in starts:
            inside = all(low[k] <= start[k] <= high[k] + 0.05 for k in range(3))
            hit = cast(scene, start, _DOWN) if inside else None
            if hit and hit.normal.z >= _UPRIGHT:
                return hit
    raise BadInputError("There is no surface below the middle of the view; set the 3D cursor over a floor or a table.")


def _flat_in_view(scene: bpy.types.Scene) -> Hit | None:
    """The level, flat surface that the picture shows nearest to its middle: a floor or a table, no leaf of a plant."""
    steps = [k / 24 - 0.5 for k in range(2, 23)]
    for x, y in sorted(((x, y) for x in steps for y in steps), key=lambda at: at[0] ** 2 + at[1] ** 2):
        origin, direction = picture_ray(scene, 0.5 + x, 0.5 + y)
        hit = cast(scene, origin, direction)
        if hit is None or hit.normal.z < 0.95:
            continue
        around = [
            cast(scene, hit.place + Vector((dx, dy, 0.05)), _DOWN, 0.1)
            for dx, dy in ((_FLAT, 0), (-_FLAT, 0), (0, _FLAT), (0, -_FLAT))
        ]
        if not all(one and abs(one.place.z - hit.place.z) < 0.02 for one in around):
            continue
        above = [hit.place + Vector((dx, dy, 0.2)) for dx, dy in ((0, 0), (_FLAT, 0), (-_FLAT, 0))]
        if not any(cast(scene, place, origin - place, (origin - place).length) for place in above):
            return hit  # and what stands there is in sight
    return None


def below_cursor(scene: bpy.types.Scene) -> Hit:
    """The surface straight below the 3D cursor; raises `BadInputError` where there is none."""
    hit = cast(scene, scene.cursor.location + Vector((0, 0, 0.05)), _DOWN)
    if hit is None:
        raise BadInputError("There is no surface below the 3D cursor; set it above a floor or a table.")
    return hit


def _clear_of_walls(scene, place: Vector, radius: float, tall: float) -> Vector:
    """Move a place so that a thing of `radius` that stands there keeps off upright surfaces around it."""
    for _ in range(3):
        push = Vector()
        for k in range(12):
            angle = k * math.pi / 6
            way = Vector((math.cos(angle), math.sin(angle), 0))
            hit = cast(scene, place + Vector((0, 0, max(tall / 2, 0.02))), way, radius)
            if hit and hit.distance < radius:
                need = way * -(radius - hit.distance + 0.005)
                push = Vector((max(push.x, need.x, key=abs), max(push.y, need.y, key=abs), 0))
        if not push.length:
            break
        place = place + push
    return place


def _drop(scene, points: np.ndarray, height: float) -> float:
    """How far a thing can fall until one of its points touches: the least gap below any of them, in metres."""
    lift = float(np.ptp(points[:, 2])) * 0.5 + 0.02
    lowest = np.argsort(points[:, 2])
    chosen = np.unique(np.concatenate([lowest[: _PROBES // 2], lowest[:: max(len(lowest) * 2 // _PROBES, 1)]]))
    gaps = []
    for x, y, z in points[chosen].tolist():
        # From as high as the thing's middle: what reaches over it, a table top above the floor, is not below it.
        hit = cast(scene, Vector((x, y, min(z, height) + lift)), _DOWN)
        if hit:
            gaps.append(z - hit.place.z)
    return min(gaps, default=0.0)
