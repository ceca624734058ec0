"""`bpy.ops.scan_relight.fit`: roughness and specular of each object; stored in the result folder."""

from __future__ import annotations

import bpy

from .settings_props import StageOperator, with_settings


@with_settings
class SCAN_RELIGHT_OT_fit(StageOperator, bpy.types.Operator):
    """Fit roughness and specular of each object."""

    bl_idname = "scan_relight.fit"
    bl_label = "Recover Highlights"
    bl_description = "Fit roughness and specular of each object"
    bl_options = set()  # the scene stays as it is: no undo step
    until = "specular"
