"""`bpy.ops.scan_relight.check_capture`: read the scene's capture and say what it holds and what is wrong with it."""

from __future__ import annotations

import bpy

from ...addon.core.errors import ScanRelightError
from ..base import poll
from . import findings, reading_props


class SCAN_RELIGHT_OT_check_capture(bpy.types.Operator):
    """Check the capture that is chosen in the panel."""

    bl_idname = "scan_relight.check_capture"
    bl_label = "Check Capture"
    bl_description = "Read the capture and show what it holds and what is wrong with it; nothing is changed"

    @classmethod
    def poll(cls, context):
        """A folder is needed."""
        return poll.has_capture(cls, context)

    def execute(self, context):
        """With a window beside it; in the background at once."""
        choices = context.scene.scan_relight
        if not bpy.app.background:
            try:
                findings.begin(choices)
            except OSError as error:
                self.report({"ERROR"}, f"The check can't be started ({error.strerror or error}); start Blender anew.")
                return {"CANCELLED"}
            return {"FINISHED"}
        from ...addon.core.io.read import describe, read_capture

        try:
            facts = describe(read_capture(findings.key(choices)[0], reading_props.reading(choices.reading)))
        except ScanRelightError as error:
            findings.put(choices, str(error))
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        findings.put(choices, facts)
        for sentence in facts["warnings"]:
            self.report({"WARNING"}, sentence)
        return {"FINISHED"}
