"""What a new light or object has to know of the room: its bounds, what is looked at, what is hit, how bright it is."""

import math
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Vector

from ...core.brdf.lambertian import TYPICAL_ALBEDO
from ...core.errors import BadInputError
from ...core.luminance import LUMINANCE
from ...core.photo import MIDDLE_GREY
from ..custom_properties import OBJECT_ID
from ..data.images import image_array
from ..data.materials import opacity

ROOM_LIGHT = "scan_relight_room_light"
"""Custom property of the scene: median irradiance of the scanned room, in the frames' unit."""
PICTURE = tuple(((k % 11 + 0.5) / 11, (k // 11 + 0.5) / 11) for k in range(11 * 11))
"""Points of the picture, as `picture_ray` takes them, at which it is sampled."""
VIEW, CURSOR, OBJECT = "VIEW", "CURSOR", "OBJECT"


class Hit(NamedTuple):
    """Where a ray ends: location and unit normal towards the ray's origin (metres), distance, object, material slot."""

    location: Vector
    normal: Vector
    distance: float
    obj: bpy.types.Object
    slot: int = 0

    @property
    def material(self) -> bpy.types.Material | None:
        """The material that is hit."""
        return self.obj.material_slots[self.slot].material if self.obj.material_slots else None


def room_objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The objects that were scanned. Raises `BadInputError`: the scene has none."""
    objects = [obj for obj in scene.objects if OBJECT_ID in obj and obj.type == "MESH"]
    if not objects:
        raise BadInputError(
            f"Scene '{scene.name}' holds no scanned room; recover a capture or open a result's scene.blend first."
        )
    return objects


def bounds(scene: bpy.types.Scene) -> tuple[Vector, Vector]:
    """Lowest and highest corner of the scanned room in metres; raises `BadInputError` where there is none."""
    corners = np.array([obj.matrix_world @ Vector(corner) for obj in room_objects(scene) for corner in obj.bound_box])
    return Vector(corners.min(0)), Vector(corners.max(0))


def cast(scene: bpy.types.Scene, origin: Vector, direction: Vector, distance: float = 1e4) -> Hit | None:
    """The first surface along a ray."""
    direction = direction.normalized()
    depsgraph = depsgraph_of(scene)
    hit, location, normal, face, obj, _ = scene.ray_cast(depsgraph, origin, direction, distance=distance)
    if not hit:
        return None
    slot, count = 0, len(obj.material_slots)
    if count > 1 and obj.type == "MESH":
        slot = min(obj.evaluated_get(depsgraph).data.polygons[face].material_index, count - 1)
    return Hit(location, -normal if normal.dot(direction) > 0 else normal, (location - origin).length, obj, slot)


def leaves(scene: bpy.types.Scene, origin: Vector, direction: Vector) -> bool:
    """Whether a ray leaves the room; what transmits most of the light, such as a pane, does not stop it."""
    for _ in range(8):
        hit = cast(scene, origin, direction)
        if hit is None:
            return True
        if hit.material is None or opacity(hit.material) >= 0.5:
            return False
        origin = hit.location + direction.normalized() * 1e-4
    return False


def depsgraph_of(scene: bpy.types.Scene) -> bpy.types.Depsgraph:
    """The evaluated state of a scene, also of one that no window shows."""
    layer = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    layer.update()
    return layer.depsgraph


def target_of(scene: bpy.types.Scene, kind: str = VIEW, obj: bpy.types.Object | None = None) -> Vector:
    """What a light is aimed at.

    Parameters
    ----------
    kind : str
        `VIEW`: the surface in the middle of the camera's picture, or the room's middle without a camera; `CURSOR`:
        the 3D cursor; `OBJECT`: the middle of `obj`'s box.

    Raises
    ------
    BadInputError
        `OBJECT` without an object, or no room in the scene.
    """
    if kind == OBJECT:
        if obj is None:
            raise BadInputError("No object is selected to aim the light at; select one or aim at the view instead.")
        return sum((obj.matrix_world @ Vector(c) for c in obj.bound_box), Vector()) / 8
    if kind == CURSOR:
        return scene.cursor.location.copy()
    low, high = bounds(scene)
    hit = cast(scene, *picture_ray(scene)) if scene.camera else None
    return hit.location if hit else (low + high) / 2


def picture_ray(scene: bpy.types.Scene, x: float = 0.5, y: float = 0.5) -> tuple[Vector, Vector]:
    """Origin and direction of the ray through a place in the camera's picture: x and y from its lower left, 0...1."""
    pose = scene.camera.matrix_world
    right_top, right_low, left_low, _ = scene.camera.data.view_frame(scene=scene)
    middle = left_low + (right_low - left_low) * x + (right_top - right_low) * y
    if scene.camera.data.type == "ORTHO":
        return pose @ Vector((middle.x, middle.y, 0)), (pose.to_3x3() @ Vector((0, 0, -1))).normalized()
    return pose.translation.copy(), (pose.to_3x3() @ middle).normalized()


def view_direction(scene: bpy.types.Scene) -> Vector:
    """Where the camera looks, level and of unit length; +Y without a camera."""
    if scene.camera:
        direction = picture_ray(scene)[1]
        level = Vector((direction.x, direction.y, 0))
        if level.length > 1e-3:
            return level.normalized()
    return Vector((0, 1, 0))


def room_light(scene: bpy.types.Scene) -> float:
    """Median irradiance of the scanned room's surfaces in the frames' unit: by the shading, else the exposure."""
    if not scene.get(ROOM_LIGHT):
        by_exposure = math.pi * MIDDLE_GREY / 2**scene.view_settings.exposure / TYPICAL_ALBEDO
        scene[ROOM_LIGHT] = _median_shading() or by_exposure
    return float(scene[ROOM_LIGHT])


def _median_shading() -> float | None:
    image = next((i for i in bpy.data.images if bpy.path.basename(i.filepath) == "shading.exr"), None)
    if image is None or not all(image.size):
        return None
    values = image_array(image)[::8, ::8, :3] @ LUMINANCE
    values = values[np.isfinite(values) & (values > 0)]
    return float(np.median(values)) if len(values) else None
