"""`bpy.ops.scan_relight.shade`: the light on each element, and its albedo; stored in the result folder."""

from __future__ import annotations

import bpy

from .settings_props import StageOperator, with_settings


@with_settings
class SCAN_RELIGHT_OT_shade(StageOperator, bpy.types.Operator):
    """Gather the light that falls on each element and divide it out."""

    bl_idname = "scan_relight.shade"
    bl_label = "Recover Light and Albedo"
    bl_description = "Gather the light that falls on each element and divide it out"
    bl_options = set()  # the scene stays as it is: no undo step
    until = "shading"
