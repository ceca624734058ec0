"""`bpy.ops.scan_relight.*` for the recovery, whole and in steps; each does what is missing before it."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from pathlib import Path

import bpy

from ...addon.bridge.corrections.corrections import keep_for_run
from .. import preferences
from ..base import poll
from ..base.at_once import OneSentence
from . import reading_props
from .settings_props import FROM_STAGE, SceneStageOperator, StageOperator, setting_infos, setting_value, startable


class SCAN_RELIGHT_OT_accumulate(StageOperator, bpy.types.Operator):
    """Project the frames onto the surface and take each element's median"""

    bl_idname = "scan_relight.accumulate"
    bl_label = "Recover Frames to Texture"
    until = "lit_diffuse"


class SCAN_RELIGHT_OT_shade(StageOperator, bpy.types.Operator):
    """Gather the light that falls on each element and divide it out"""

    bl_idname = "scan_relight.shade"
    bl_label = "Recover Light and Albedo"
    until = "shading"


class SCAN_RELIGHT_OT_fit(StageOperator, bpy.types.Operator):
    """Fit roughness and specular of each object"""

    bl_idname = "scan_relight.fit"
    bl_label = "Recover Highlights"
    until = "specular"


class SCAN_RELIGHT_OT_write(SceneStageOperator, bpy.types.Operator):
    """Put the recovered materials and images onto the imported objects"""

    bl_idname = "scan_relight.write"
    bl_label = "Write Materials"
    import_first = False


class SCAN_RELIGHT_OT_recover(SceneStageOperator, bpy.types.Operator):
    """Import the capture, run every stage and put the materials onto the objects"""

    bl_idname = "scan_relight.recover"
    bl_label = "Recover Capture"


TARGETS = {
    "recover": "Recover the capture beside this window; what is finished already is not done again",
    "write": "Put the recovered materials onto the objects that were imported",
    "import_capture": "Bring the capture's objects, cameras and frames into the scene, as they were scanned",
}


@poll.has_capture
@startable
class SCAN_RELIGHT_OT_run(OneSentence, bpy.types.Operator):
    """Run what the panel has chosen"""

    bl_idname = "scan_relight.run"
    bl_label = "Run Recovery"

    target: bpy.props.EnumProperty(
        name="Operator",
        description="What is run",
        default="recover",
        items=[(name, name.replace("_", " ").capitalize(), text) for name, text in TARGETS.items()],
    )
    from_stage: FROM_STAGE

    @classmethod
    def description(cls, context, properties):
        if properties.from_stage != "NONE":
            return "Do this stage and all later ones anew; those before it are taken as they are stored"
        return TARGETS[properties.target]

    def execute(self, context):
        return self.attempt(lambda: self.start(context.scene))

    def start(self, scene) -> set[str]:
        """Hand the choices over; what the artist gave of a room that is run again goes to where the run heeds it."""
        operator = getattr(bpy.ops.scan_relight, self.target)
        how = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        chosen = self.chosen(scene.scan_relight)
        if self.target != "import_capture":
            capture = Path(bpy.path.abspath(chosen["capture_folder"])).absolute()
            keep_for_run(scene, Path(chosen["result_folder"]), capture)
        verdict = operator(how, ask=False, **chosen)
        return {"FINISHED"} if verdict & {"FINISHED", "RUNNING_MODAL"} else {"CANCELLED"}

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
