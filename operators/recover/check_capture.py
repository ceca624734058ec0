"""`bpy.ops.scan_relight.check_capture`: read the scene's capture and say what it holds and what is wrong with it."""

from __future__ import annotations

import bpy

from ...addon.core.errors import ScanRelightError
from ..base import poll
from ..base.at_once import AtOnce
from . import findings, reading_props


@poll.has_capture
@poll.has_scene
class SCAN_RELIGHT_OT_check_capture(AtOnce, bpy.types.Operator):
    """Read the capture and show what it holds and what is wrong with it; nothing is changed"""

    bl_idname = "scan_relight.check_capture"
    bl_label = "Check Capture"
    bl_options = {"REGISTER"}

    def work(self, context):
        """With a window beside it; in the background at once."""
        choices = context.scene.scan_relight
        if not bpy.app.background:
            findings.begin(choices)
            return ()
        from ...addon.core.io.read import describe, read_capture

        try:
            facts = describe(read_capture(findings.key(choices)[0], reading_props.reading(choices.reading)))
        except ScanRelightError as error:
            findings.put(choices, str(error))
            raise
        findings.put(choices, facts)
        return facts["warnings"]
