"""`bpy.ops.scan_relight.*` for the recovery, whole and in steps; each does what is missing before it."""

from __future__ import annotations

import bpy

from .settings_props import SceneStageOperator, StageOperator, with_settings


@with_settings
class SCAN_RELIGHT_OT_accumulate(StageOperator, bpy.types.Operator):
    """Project the frames onto the surface and take each element's median"""

    bl_idname = "scan_relight.accumulate"
    bl_label = "Recover Frames to Texture"
    until = "lit_diffuse"


@with_settings
class SCAN_RELIGHT_OT_shade(StageOperator, bpy.types.Operator):
    """Gather the light that falls on each element and divide it out"""

    bl_idname = "scan_relight.shade"
    bl_label = "Recover Light and Albedo"
    until = "shading"


@with_settings
class SCAN_RELIGHT_OT_fit(StageOperator, bpy.types.Operator):
    """Fit roughness and specular of each object"""

    bl_idname = "scan_relight.fit"
    bl_label = "Recover Highlights"
    until = "specular"


@with_settings
class SCAN_RELIGHT_OT_write(SceneStageOperator, bpy.types.Operator):
    """Put the recovered materials and images onto the imported objects"""

    bl_idname = "scan_relight.write"
    bl_label = "Write Materials"
    import_first = False


@with_settings
class SCAN_RELIGHT_OT_recover(SceneStageOperator, bpy.types.Operator):
    """Import the capture, run every stage and put the materials onto the objects"""

    bl_idname = "scan_relight.recover"
    bl_label = "Recover Capture"
