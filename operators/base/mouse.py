"""The ray under the mouse, for operators that pick a place of the room."""

from __future__ import annotations

from bpy_extras import view3d_utils


def mouse_ray(context, event):
    """Origin and direction of the ray under the mouse; None outside the 3D views."""
    for area in context.screen.areas:
        region = next((one for one in area.regions if one.type == "WINDOW"), None)
        if area.type != "VIEW_3D" or region is None:
            continue
        at = event.mouse_x - region.x, event.mouse_y - region.y
        if 0 <= at[0] < region.width and 0 <= at[1] < region.height:
            view = area.spaces.active.region_3d
            return (
                view3d_utils.region_2d_to_origin_3d(region, view, at),
                view3d_utils.region_2d_to_vector_3d(region, view, at),
            )
    return None
