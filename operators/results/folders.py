"""`bpy.ops.scan_relight.*` for result folders: free their stages, move them, open their page."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from pathlib import Path

import bpy

from ...addon.bridge.results import find, home
from ...addon.core.errors import ScanRelightError
from .. import preferences
from ..base import poll
from ..base.at_once import AtOnce, NothingDone
from . import told


def folders(scene: bpy.types.Scene | None) -> list[Path]:
    """The results whose stages can be cleared: in the results folder, beside the .blend, and the scene's own."""
    from ...addon.core.results.cache import results as below

    beside = home.beside()
    own = told.folder_of(scene) if scene is not None else None
    return [*below(preferences.results_folder()), *(below(beside) if beside else ()), *([own] if own else ())]


@poll.no_run
class SCAN_RELIGHT_OT_clear_cache(AtOnce, bpy.types.Operator):
    """Delete the finished stages that further runs would go on from: of the results in the results folder, beside this
    file, and of this scene's. The results themselves stay as they are"""

    bl_idname = "scan_relight.clear_cache"
    bl_label = "Clear Stages"
    bl_options = {"REGISTER"}

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(
            self,
            event,
            title="Clear the finished stages?",
            message="Results stay as they are; a further run begins anew.",
            confirm_text="Clear",
            icon="QUESTION",
        )

    def work(self, context):
        from ...addon.core.results.cache import clear

        done = clear(folders(context.scene))
        preferences.forget_size()
        self.report(
            {"INFO"},
            f"{preferences.amount(done.freed)} of stages deleted; {done.results} "
            f"result{'s' * (done.results != 1)} kept.",
        )
        return done.left


@poll.needs(lambda context: home.earlier_results(), "No result lies in the extension's own folder.")
@poll.no_run
class SCAN_RELIGHT_OT_move_results(AtOnce, bpy.types.Operator):
    """Move the results of earlier versions out of the extension's own folder into the results folder, so that removing
    the extension can't delete them; this file's images are pointed there"""

    bl_idname = "scan_relight.move_results"
    bl_label = "Move Out"

    def work(self, context):
        """Move each; one that can't be moved stays whole where it is, and is told."""
        there, problems = home.earlier_results(), []
        for folder in there:
            try:
                find.move(folder, preferences.results_folder())
            except ScanRelightError as error:
                problems.append(str(error))
        preferences.forget_size()
        moved = len(there) - len(problems)
        if not moved:
            raise NothingDone(" ".join(problems))
        self.report(
            {"INFO"},
            f"{moved} result{'s' * (moved != 1)} moved into '{preferences.results_folder()}'; save "
            "this file to keep its images there.",
        )
        return problems


def _page(context) -> Path | None:
    folder = told.folder_of(context.scene) if context.scene else None
    return folder / told.PAGE if folder is not None and (folder / told.PAGE).is_file() else None


@poll.needs(_page, "There is no report yet; run the recovery to its end first.")
class SCAN_RELIGHT_OT_open_report(bpy.types.Operator):
    """Open the page with figures, pictures and doubts of this result in the browser"""

    bl_idname = "scan_relight.open_report"
    bl_label = "Open Report"

    def execute(self, context):
        """Open it; in the background only say where it lies."""
        page = _page(context)
        if bpy.app.background:
            self.report({"INFO"}, str(page))
            return {"FINISHED"}
        return bpy.ops.wm.path_open(filepath=str(page))
