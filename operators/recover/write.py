"""`bpy.ops.scan_relight.write`: recovered materials and baked images onto the imported objects."""

from __future__ import annotations

import bpy

from .settings_props import SceneStageOperator, with_settings


@with_settings
class SCAN_RELIGHT_OT_write(SceneStageOperator, bpy.types.Operator):
    """Put materials and baked images onto the objects."""

    bl_idname = "scan_relight.write"
    bl_label = "Write Materials"
    bl_description = "Put the recovered materials and images onto the imported objects"
    import_first = False
