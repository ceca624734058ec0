"""Smooth shading of recovered objects, which stays when they are recovered again."""

from collections.abc import Iterable

import bpy

from ..custom_properties import SMOOTH


def smooth(objects: Iterable[bpy.types.Object], angle: float) -> int:
    """Shade objects smooth but for edges sharper than `angle` radians; 0 makes them flat again.

    The scan's geometric normals are what the light was divided by; smoothing changes how it is shown, not what was
    found. Returns how many meshes were changed.
    """
    changed = set()
    for obj in objects:
        obj.pop(SMOOTH, None)
        if angle > 0:
            obj[SMOOTH] = float(angle)
        if obj.data not in changed:
            shade(obj.data, angle)
            changed.add(obj.data)
    return len(changed)


def shade(data: bpy.types.Mesh, angle: float) -> None:
    """Shade a mesh smooth but for edges sharper than `angle`, or flat."""
    if angle > 0:
        data.shade_smooth()
        data.set_sharp_from_angle(angle=angle)
    else:
        if "sharp_edge" in data.attributes:
            data.attributes.remove(data.attributes["sharp_edge"])
        data.shade_flat()
    data.update()
