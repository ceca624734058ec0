"""`bpy.ops.scan_relight.run`: the panel's buttons. Starts another operator with what the scene has chosen."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from pathlib import Path

import bpy

from ...addon.bridge.corrections.corrections import keep_for_run
from ...addon.core.errors import ScanRelightError
from .. import preferences
from ..base import poll
from . import reading_props
from .settings_props import FROM_STAGE, can_start, setting_infos, setting_value

TARGETS = {
    "recover": "Recover the capture beside this window; what is finished already is not done again",
    "write": "Put the recovered materials onto the objects that were imported",
    "import_capture": "Bring the capture's objects, cameras and frames into the scene, as they were scanned",
}


class SCAN_RELIGHT_OT_run(bpy.types.Operator):
    """Run what the panel has chosen."""

    bl_idname = "scan_relight.run"
    bl_label = "Run Recovery"
    bl_description = "Run what the panel has chosen"

    target: bpy.props.EnumProperty(
        name="Operator",
        description="What is run",
        default="recover",
        items=[(name, name.replace("_", " ").capitalize(), text) for name, text in TARGETS.items()],
    )
    from_stage: FROM_STAGE

    @classmethod
    def description(cls, context, properties):
        """The tooltip."""
        if properties.from_stage != "NONE":
            return "Do this stage and all later ones anew; those before it are taken as they are stored"
        return TARGETS[properties.target]

    @classmethod
    def poll(cls, context):
        """As for what is run, and a capture has to be chosen."""
        return can_start(cls, context) and poll.has_capture(cls, context)

    def execute(self, context):
        """Hand the choices over."""
        operator = getattr(bpy.ops.scan_relight, self.target)
        how = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        try:
            chosen = self.chosen(context.scene.scan_relight)
            if self.target != "import_capture":
                self.keep_corrections(context.scene, chosen)
            verdict = operator(how, ask=False, **chosen)
        except (RuntimeError, ScanRelightError) as error:  # reported already, and again by Blender as an exception
            self.report({"ERROR"}, str(error).removeprefix("Error: ").strip())
            return {"CANCELLED"}
        return {"FINISHED"} if verdict & {"FINISHED", "RUNNING_MODAL"} else {"CANCELLED"}

    @staticmethod
    def keep_corrections(scene, chosen) -> None:
        """What the artist gave of a room that is run again goes to where the run heeds it."""
        keep_for_run(scene, Path(chosen["result_folder"]), Path(bpy.path.abspath(chosen["capture_folder"])).absolute())

    def chosen(self, choices) -> dict:
        """The target's properties."""
        found = {"capture_folder": choices.capture_folder}
        found |= {name: getattr(choices.reading, name) for name in reading_props.NAMES}
        if self.target == "import_capture":
            return found
        found["result_folder"] = str(
            preferences.result_folder(choices.result_folder, choices.capture_folder, choices.id_data)
        )
        found |= {"preset": choices.preset, "from_stage": self.from_stage}
        found |= {name: getattr(choices, name) for name in ("images", "copies")}
        wanted = {*choices.settings.changed(choices.preset), "threads", "seed"}
        return found | {
            info.name: setting_value(choices.settings, info) for info in setting_infos() if info.name in wanted
        }
