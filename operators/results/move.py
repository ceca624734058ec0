"""`bpy.ops.scan_relight.move_results`: results of earlier versions leave the extension's own folder."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.results import find, home
from ...addon.core.errors import ScanRelightError
from .. import preferences
from ..base import poll


@poll.needs(lambda context: home.earlier_results(), "No result lies in the extension's own folder.")
@poll.no_run
class SCAN_RELIGHT_OT_move_results(bpy.types.Operator):
    """Move the results of earlier versions out of the extension's own folder into the results folder, so that removing
    the extension can't delete them; this file's images are pointed there"""

    bl_idname = "scan_relight.move_results"
    bl_label = "Move Out"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Move each; one that can't be moved stays whole where it is, and is told."""
        moved = 0
        for folder in home.earlier_results():
            try:
                find.move(folder, preferences.results_folder())
                moved += 1
            except ScanRelightError as error:
                self.report({"WARNING"}, str(error))
        preferences.forget_size()
        if not moved:
            return {"CANCELLED"}
        self.report(
            {"INFO"},
            f"{moved} result{'s' * (moved != 1)} moved into '{preferences.results_folder()}'; save "
            "this file to keep its images there.",
        )
        return {"FINISHED"}
