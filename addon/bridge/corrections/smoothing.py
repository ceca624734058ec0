"""Smooth shading by angle, kept with the object so that it comes back when a run makes its mesh anew."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..marks import SMOOTH


def smooth(things: Iterable[bpy.types.Object], angle: float) -> int:
    """Shade objects smooth but for edges sharper than `angle` radians; 0 makes them flat again.

    The scan's geometric normals are what the light was divided by; smoothing changes how it is shown, not what was
    found.

    Returns
    -------
    int
        How many meshes were changed.
    """
    changed = set()
    for thing in things:
        if angle > 0:
            thing[SMOOTH] = float(angle)
        elif SMOOTH in thing:
            del thing[SMOOTH]
        if thing.data not in changed:
            _shade(thing.data, angle)
            changed.add(thing.data)
    return len(changed)


def reapply(thing: bpy.types.Object) -> None:
    """Shade an object as was chosen for it, if anything was."""
    if thing.type == "MESH" and SMOOTH in thing and not thing.data.library:
        _shade(thing.data, thing[SMOOTH])


def _shade(data: bpy.types.Mesh, angle: float) -> None:
    if angle > 0:
        data.shade_smooth()
        data.set_sharp_from_angle(angle=angle)
    else:
        if "sharp_edge" in data.attributes:
            data.attributes.remove(data.attributes["sharp_edge"])
        data.shade_flat()
    data.update()
