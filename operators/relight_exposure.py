"""`bpy.ops.scan_relight.expose`: the exposure that the present light asks for."""

from __future__ import annotations

import bpy

from ..addon.bridge import relight_exposure
from .relight_base import RelightOperator


class SCAN_RELIGHT_OT_expose(RelightOperator, bpy.types.Operator):
    """Set the scene's exposure to its light."""

    bl_idname = "scan_relight.expose"
    bl_label = "Expose for This Light"
    bl_description = ("Measure the light in a small picture and set the exposure so that its median is middle grey; "
                      "takes some seconds")

    def work(self, context):
        """Measure and set."""
        relight_exposure.expose(context.scene)


class SCAN_RELIGHT_OT_restore_exposure(RelightOperator, bpy.types.Operator):
    """Back to the exposure of the capture."""

    bl_idname = "scan_relight.restore_exposure"
    bl_label = "Captured Exposure"
    bl_description = "Set the exposure back to what it was before it was measured"

    def work(self, context):
        """Put it back."""
        relight_exposure.restore(context.scene)


def follow(scene: bpy.types.Scene) -> None:
    """After a change of the light: expose for it where that was asked for."""
    if scene.scan_relight_studio.follow and scene.camera is not None:
        relight_exposure.expose(scene)
