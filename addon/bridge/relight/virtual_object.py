"""Virtual objects that were not scanned, on the room's surfaces; in the scene, they receive and reflect its light."""

import math
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...core.brdf.model import Principled
from ...core.errors import BadInputError
from ..data.added import own_collection
from ..data.arrays import vertices_of
from ..data.materials import plain_material
from ..light.room import Hit, bounds, cast, depsgraph_of, picture_ray

KIND = "scan_relight_virtual"
"""Custom property of an object that was placed in the room."""
COLLECTION = "Virtual Objects"
SPHERE, CUBE, MONKEY = "SPHERE", "CUBE", "MONKEY"
NAMES = {SPHERE: "Sphere", CUBE: "Cube", MONKEY: "Suzanne"}
OWN, MATTE, GLOSSY, MIRROR = "OWN", "MATTE", "GLOSSY", "MIRROR"
LOOKS = {
    MATTE: Principled((0.5, 0.5, 0.5), 1.0),
    GLOSSY: Principled((0.35, 0.02, 0.015), 0.15, specular_level=0.5),
    MIRROR: Principled((0.95, 0.95, 0.95), 0.0, metallic=1.0, specular_level=0.5),
}
_MIN_NORMAL_Z = 0.5
"""Minimum z of the normal of a surface that an object can stand on."""
_FLAT_RADIUS = 0.18
"""Radius in metres around a point that has to be level for a floor or a table."""
_MAX_RAYS = 400
_DOWN = Vector((0, 0, -1))


def add_virtual(
    scene: bpy.types.Scene, shape: str, size: float = 0.3, look: str = MATTE, surface: Hit | None = None
) -> bpy.types.Object:
    """Make a simple object and stand it on a surface of the room; `surface` and errors as of `stand`.

    Parameters
    ----------
    shape, look : str
        One of `NAMES`, and of `LOOKS`.
    size : float
        Largest extent in metres.
    """
    surface = surface or place_in_view(scene)
    mesh = bpy.data.meshes.new(NAMES[shape])
    bm = bmesh.new()
    if shape == SPHERE:
        bmesh.ops.create_uvsphere(bm, u_segments=64, v_segments=32, radius=0.5)
    elif shape == CUBE:
        bmesh.ops.create_cube(bm, size=1.0)
    else:
        bmesh.ops.create_monkey(bm)
    bm.to_mesh(mesh)
    bm.free()
    obj = bpy.data.objects.new(NAMES[shape], mesh)
    obj.scale = (size / float(np.ptp(vertices_of(mesh), axis=0).max()),) * 3
    own_collection(scene, COLLECTION).objects.link(obj)
    set_look(obj, look)
    if shape != CUBE:
        mesh.shade_smooth()
    if shape == MONKEY:
        obj.modifiers.new("Smooth", "SUBSURF").render_levels = 2
        if scene.camera:
            to_camera = scene.camera.matrix_world.translation - surface.location
            obj.rotation_euler.z = math.atan2(to_camera.y, to_camera.x) + math.pi / 2
    stand(scene, obj, surface)
    return obj


def set_look(obj: bpy.types.Object, look: str) -> None:
    """Give an object one of the materials of `LOOKS`; `OWN` leaves its own."""
    if look == OWN:
        return
    name = f"Scan Relight {look.lower()}"
    material = bpy.data.materials.get(name) or plain_material(name, LOOKS[look])
    obj.data.materials.clear()
    obj.data.materials.append(material)


def stand(scene: bpy.types.Scene, obj: bpy.types.Object, surface: Hit | None = None) -> None:
    """Place an object on a surface of the room: clear of the walls, lowered until it touches, otherwise as it is.

    Parameters
    ----------
    surface : Hit, optional
        The surface; by default what `place_in_view` finds. A vertical one means the floor in front of it.

    Raises
    ------
    BadInputError
        There is no surface below.
    """
    surface = surface or place_in_view(scene, obj)
    corners = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box])
    if obj.type == "MESH":  # all vertices, with modifiers evaluated
        evaluated = obj.evaluated_get(depsgraph_of(scene))
        corners = vertices_of(evaluated.data, evaluated.matrix_world)
    with _hidden(obj):  # or it would stand on itself
        low, high = corners.min(0), corners.max(0)
        pivot = Vector((*((low + high) / 2)[:2], low[2]))
        radius = float(np.linalg.norm(corners[:, :2] - np.array(pivot[:2]), axis=1).max())
        place = surface.location
        if surface.normal.z < _MIN_NORMAL_Z:
            below = cast(scene, place + surface.normal * (radius + 0.01), _DOWN)
            if below is None:
                raise BadInputError("There is no surface below that place to stand on; choose a floor or a table top.")
            place = below.location
        place = _clear_of_walls(scene, place, radius, float(high[2] - low[2]))
        shift = place - pivot
        shift.z -= _drop(scene, corners + np.array(shift), place.z)
    if obj.parent:
        obj.matrix_world = Matrix.Translation(shift) @ obj.matrix_world
    else:
        obj.location += shift
    obj[KIND] = True
    depsgraph_of(scene)


@contextmanager
def _hidden(obj: bpy.types.Object) -> Iterator[None]:
    """Within: no ray hits an object."""
    hidden = obj.hide_viewport
    try:
        obj.hide_viewport = True
        yield
    finally:
        obj.hide_viewport = hidden


def place_in_view(scene: bpy.types.Scene, ignored: bpy.types.Object | None = None) -> Hit:
    """The surface to stand on that is nearest the picture's middle, else below the 3D cursor or the room's middle."""
    with _hidden(ignored) if ignored is not None else nullcontext():
        low, high = bounds(scene)
        starts = [scene.cursor.location + Vector((0, 0, 0.05)), (low + high) / 2]
        if scene.camera:
            if hit_in_view := _flat_in_view(scene):
                return hit_in_view
            origin, direction = picture_ray(scene)
            if hit := cast(scene, origin, direction):
                starts.insert(0, hit.location - direction * min(0.8, 0.4 * hit.distance))
        for start in starts:
            inside = all(low[k] <= start[k] <= high[k] + 0.05 for k in range(3))
            hit = cast(scene, start, _DOWN) if inside else None
            if hit and hit.normal.z >= _MIN_NORMAL_Z:
                return hit
    raise BadInputError("There is no surface below the middle of the view; set the 3D cursor over a floor or a table.")


def _flat_in_view(scene: bpy.types.Scene) -> Hit | None:
    """The level, flat surface nearest to the picture's middle: a floor or a table, no leaf of a plant."""
    steps = [k / 24 - 0.5 for k in range(2, 23)]
    for x, y in sorted(((x, y) for x in steps for y in steps), key=lambda point: point[0] ** 2 + point[1] ** 2):
        origin, direction = picture_ray(scene, 0.5 + x, 0.5 + y)
        hit = cast(scene, origin, direction)
        if hit is None or hit.normal.z < 0.95:
            continue
        around = [
            cast(scene, hit.location + Vector((dx, dy, 0.05)), _DOWN, 0.1)
            for dx, dy in ((_FLAT_RADIUS, 0), (-_FLAT_RADIUS, 0), (0, _FLAT_RADIUS), (0, -_FLAT_RADIUS))
        ]
        if not all(neighbour and abs(neighbour.location.z - hit.location.z) < 0.02 for neighbour in around):
            continue
        above = [hit.location + Vector((dx, dy, 0.2)) for dx, dy in ((0, 0), (_FLAT_RADIUS, 0), (-_FLAT_RADIUS, 0))]
        if not any(cast(scene, place, origin - place, (origin - place).length) for place in above):
            return hit  # and an object there is visible
    return None


def below_cursor(scene: bpy.types.Scene) -> Hit:
    """The surface straight below the 3D cursor; raises `BadInputError` where there is none."""
    hit = cast(scene, scene.cursor.location + Vector((0, 0, 0.05)), _DOWN)
    if hit is None:
        raise BadInputError("There is no surface below the 3D cursor; set it above a floor or a table.")
    return hit


def _clear_of_walls(scene, place: Vector, radius: float, height: float) -> Vector:
    """Move a place so that an object of `radius` that stands there is clear of vertical surfaces around it."""
    for _ in range(3):
        push = Vector()
        for k in range(12):
            angle = k * math.pi / 6
            direction = Vector((math.cos(angle), math.sin(angle), 0))
            hit = cast(scene, place + Vector((0, 0, max(height / 2, 0.02))), direction, radius)
            if hit and hit.distance < radius:
                offset = direction * -(radius - hit.distance + 0.005)
                push = Vector((max(push.x, offset.x, key=abs), max(push.y, offset.y, key=abs), 0))
        if not push.length:
            break
        place = place + push
    return place


def _drop(scene, points: np.ndarray, height: float) -> float:
    """How far an object can fall until one of its points touches: the minimum gap below them, in metres."""
    lift = float(np.ptp(points[:, 2])) * 0.5 + 0.02
    lowest = np.argsort(points[:, 2])
    chosen = np.unique(np.concatenate([lowest[: _MAX_RAYS // 2], lowest[:: max(len(lowest) * 2 // _MAX_RAYS, 1)]]))
    gaps = []
    for x, y, z in points[chosen].tolist():
        # From the height of the object's middle: what is above it, as a table top above the floor, is not below it.
        hit = cast(scene, Vector((x, y, min(z, height) + lift)), _DOWN)
        if hit:
            gaps.append(z - hit.location.z)
    return min(gaps, default=0.0)
