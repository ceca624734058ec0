"""`bpy.ops.scan_relight.import_capture`: a capture's objects, cameras and frames into the scene."""

from __future__ import annotations

import bpy

from .settings_props import CaptureOperator


class SCAN_RELIGHT_OT_import_capture(CaptureOperator, bpy.types.Operator):
    """Import a capture."""

    bl_idname = "scan_relight.import_capture"
    bl_label = "Import Capture"
    bl_description = "Bring a capture's objects, cameras and frames into the scene"

    def work(self, context):
        """Read, then build."""
        from ..addon.bridge.apply import import_capture
        from ..addon.core.capture.read import read_capture

        capture = read_capture(self.folder("capture_folder"))
        import_capture(context.scene, capture)
        return capture.warnings
