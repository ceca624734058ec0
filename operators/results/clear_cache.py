"""`bpy.ops.scan_relight.clear_cache`: free the stages of results, which can be made again. Results stay."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from pathlib import Path

import bpy

from ...addon.bridge.results import home
from .. import preferences
from ..base import poll
from ..base.at_once import AtOnce
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
