"""`bpy.ops.scan_relight.open_report`: the result's page in the browser."""

from __future__ import annotations

import bpy

from ..base import poll
from . import told


class SCAN_RELIGHT_OT_open_report(bpy.types.Operator):
    """Open the page with figures, pictures and doubts of this result in the browser"""

    bl_idname = "scan_relight.open_report"
    bl_label = "Open Report"

    @classmethod
    def poll(cls, context):
        folder = told.folder_of(context.scene) if context.scene else None
        return poll.check(
            cls,
            folder is not None and (folder / told.PAGE).is_file(),
            "There is no report yet; run the recovery to its end first.",
        )

    def execute(self, context):
        """Open it; in the background only say where it lies."""
        page = told.folder_of(context.scene) / told.PAGE
        if bpy.app.background:
            self.report({"INFO"}, str(page))
            return {"FINISHED"}
        return bpy.ops.wm.path_open(filepath=str(page))
