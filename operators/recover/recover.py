"""`bpy.ops.scan_relight.recover`: everything at once."""

from __future__ import annotations

import bpy

from .settings_props import SceneStageOperator, with_settings


@with_settings
class SCAN_RELIGHT_OT_recover(SceneStageOperator, bpy.types.Operator):
    """Recover a capture from the first stage to the last."""

    bl_idname = "scan_relight.recover"
    bl_label = "Recover Capture"
    bl_description = "Import the capture, run every stage and put the materials onto the objects"
