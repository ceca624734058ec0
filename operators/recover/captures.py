"""`bpy.ops.scan_relight.*` for a capture as it is: what it holds and what is wrong with it, and into the scene."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import shutil
import tempfile

import bpy

from ...addon.core.errors import ScanRelightError
from ..base import poll
from ..base.at_once import AtOnce
from . import findings, reading_props, room_window
from .settings_props import INTO, CaptureOperator


class SCAN_RELIGHT_OT_import_capture(CaptureOperator, bpy.types.Operator):
    """Bring a capture's objects, cameras and frames into a scene of their own, as they were scanned"""

    bl_idname = "scan_relight.import_capture"
    bl_label = "Import Capture"

    into: INTO

    def work(self, context):
        from ...addon.bridge.slices import whole
        from ...addon.core.io.read import read_capture

        capture = read_capture(self.folder("capture_folder"), reading_props.reading(self))
        return (*capture.warnings, *whole(self.change(context.scene, capture)))

    def begin(self, context):
        """Read it beside the window; large captures take a while."""
        from ...addon.bridge.job.command import command

        capture, scratch = self.folder("capture_folder"), tempfile.mkdtemp(prefix="scan-relight-")
        options = {"json": True, "room": scratch, "stop_with_stdin": True}
        words = command(["info", capture, *reading_props.options(self)], **options)
        return self.start(context, words, title=self.bl_label, capture_folder=capture, scratch=scratch)

    def load(self, job):
        from ...addon.core.results.room_file import read_capture_file

        job.warnings.extend(findings.facts(job)["warnings"])
        return read_capture_file(job.facts["scratch"])[0]

    def tidy(self, job):
        shutil.rmtree(job.facts["scratch"], ignore_errors=True)

    def change(self, scene, loaded):
        from ...addon.bridge.room.scanned import importing

        brought = yield from importing(loaded, scene if self.into == "SCENE" else None)
        if self.into == "OWN":
            room_window.show(scene, brought.scene)
        return brought.warnings


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
