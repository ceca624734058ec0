"""`bpy.ops.scan_relight.accumulate`: the frames become the lit diffuse texture; stored in the result folder."""

from __future__ import annotations

import bpy

from .settings_props import StageOperator, with_settings


@with_settings
class SCAN_RELIGHT_OT_accumulate(StageOperator, bpy.types.Operator):
    """Project the frames onto the surface and take each element's median."""

    bl_idname = "scan_relight.accumulate"
    bl_label = "Recover Frames to Texture"
    bl_description = "Project the frames onto the surface and take each element's median"
    bl_options = set()  # the scene stays as it is: no undo step
    until = "lit_diffuse"
