"""`bpy.ops.scan_relight.write`: recovered materials and baked images onto the imported objects."""

from __future__ import annotations

import bpy

from .settings_props import StageOperator, with_settings


@with_settings
class SCAN_RELIGHT_OT_write(StageOperator, bpy.types.Operator):
    """Put materials and baked images onto the objects."""

    bl_idname = "scan_relight.write"
    bl_label = "Write Materials"
    bl_description = "Put the recovered materials and images onto the imported objects"

    def work(self, context):
        """Recover whatever is not finished yet, then dress the objects."""
        return self.run(context, "write", scene=context.scene, import_first=False)
