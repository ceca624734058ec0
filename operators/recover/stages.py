"""`bpy.ops.scan_relight.*` from a capture to the room, whole and in steps; the open scene as a capture."""

import shutil
import tempfile
from pathlib import Path

import bpy

from ...addon.bridge.corrections.corrections import keep_for_run
from ...addon.bridge.job.command import command
from ...addon.bridge.results import default_folders
from ...addon.core.errors import ScanRelightError
from .. import preferences
from ..base.operator import AtOnce, OneSentence, has_capture, has_scene, needs
from ..base.panel import fields
from ..base.properties import bool_property, enum_property, folder_property, int_property
from . import findings, reading_props, room
from .settings_props import (
    FROM_STAGE,
    INTO,
    CaptureOperator,
    SceneStageOperator,
    StageOperator,
    setting_infos,
    setting_value,
    startable,
)


class SCAN_RELIGHT_OT_import_capture(CaptureOperator, bpy.types.Operator):
    """Bring a capture's objects, cameras and frames into a scene of their own, as they were scanned"""

    bl_label = "Import Capture"

    into: INTO

    def work(self, context):
        from ...addon.bridge.slices import whole
        from ...addon.core.io.read import read_capture

        capture = read_capture(self.folder("capture_folder"), reading_props.reading(self))
        return (*capture.warnings, *whole(self.change(context.scene, capture)))

    def begin(self, context):
        """Read it beside the window, as large captures take a while."""
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
            room.show(scene, brought.scene)
        return brought.warnings


@has_capture
@has_scene
class SCAN_RELIGHT_OT_check_capture(AtOnce, bpy.types.Operator):
    """Read the capture and show what it holds and what is wrong with it; nothing is changed"""

    bl_label = "Check Capture"
    bl_options = {"REGISTER"}

    def work(self, context):
        """Beside the window; in the background at once."""
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


class SCAN_RELIGHT_OT_accumulate(StageOperator, bpy.types.Operator):
    """Project the frames onto the surface and take each element's median"""

    bl_label = "Recover Frames to Texture"
    until = "lit_diffuse"


class SCAN_RELIGHT_OT_shade(StageOperator, bpy.types.Operator):
    """Gather the light that falls on each element and divide it out"""

    bl_label = "Recover Light and Albedo"
    until = "shading"


class SCAN_RELIGHT_OT_fit(StageOperator, bpy.types.Operator):
    """Fit roughness and specular of each object"""

    bl_label = "Recover Highlights"
    until = "specular"


class SCAN_RELIGHT_OT_write(SceneStageOperator, bpy.types.Operator):
    """Put the recovered materials and images onto the imported objects"""

    bl_label = "Write Materials"
    import_first = False


class SCAN_RELIGHT_OT_recover(SceneStageOperator, bpy.types.Operator):
    """Import the capture, run every stage and put the materials onto the objects"""

    bl_label = "Recover Capture"


TARGETS = {
    "recover": "Recover the capture beside this window; what is finished already is not done again",
    "write": "Put the recovered materials onto the objects that were imported",
    "import_capture": "Bring the capture's objects, cameras and frames into the scene, as they were scanned",
}


@has_capture
@startable
class SCAN_RELIGHT_OT_run(OneSentence, bpy.types.Operator):
    """Run what the panel has chosen"""

    bl_label = "Run Recovery"

    target: enum_property(
        "Operator", "What is run", [(name, name.replace("_", " ").capitalize(), text) for name, text in TARGETS.items()]
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
        """Pass the choices on; the artist's statements on a room that is run again are stored for the run."""
        operator = getattr(bpy.ops.scan_relight, self.target)
        execution_context = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        chosen = self.chosen(scene.scan_relight)
        if self.target != "import_capture":
            capture = Path(bpy.path.abspath(chosen["capture_folder"])).absolute()
            keep_for_run(scene, Path(chosen["result_folder"]), capture)
        status = operator(execution_context, ask=False, **chosen)
        return {"FINISHED"} if status & {"FINISHED", "RUNNING_MODAL"} else {"CANCELLED"}

    def chosen(self, choices) -> dict:
        """Properties of the target operator."""
        properties = {"capture_folder": choices.capture_folder}
        properties |= {name: getattr(choices.reading, name) for name in reading_props.NAMES}
        if self.target == "import_capture":
            return properties
        properties["result_folder"] = str(preferences.chosen_result(choices.id_data))
        properties |= {"preset": choices.preset, "from_stage": self.from_stage}
        properties |= {name: getattr(choices, name) for name in ("images", "copies")}
        changed = {*choices.settings.changed(choices.preset), "threads", "seed"}
        return properties | {
            info.name: setting_value(choices.settings, info) for info in setting_infos() if info.name in changed
        }


FOLDER = "scene_capture"
CAMERAS = [
    (
        "AUTO",
        "Automatic",
        "An animation where the only camera has a sequence or a clip behind it, else one frame for each camera",
    ),
    (
        "OBJECTS",
        "Each Camera",
        "One frame for each camera that has a picture behind it; only the selected cameras where some are selected",
    ),
    ("ANIMATION", "Animation", "One frame for each frame of the active camera's animation"),
]


@needs(
    lambda context: any(obj.type not in ("CAMERA", "LIGHT") for obj in context.selected_objects),
    "Select the objects of the room first.",
)
@startable
class SCAN_RELIGHT_OT_capture_from_scene(AtOnce, bpy.types.Operator):
    """Make a capture of the selected objects: their faces are the mesh, and the pictures behind the cameras (EXR) are
    the frames. Nothing in the scene is changed"""

    bl_label = "Capture From Scene"

    result_folder: folder_property(
        "Result",
        "The capture goes into a folder within this one; empty takes the panel's, or a folder of its own "
        "among the results",
    )
    cameras: enum_property("Frames", "Which cameras took the pictures", CAMERAS)
    whole_range: bool_property("Whole Range", "Take the scene's frame range", default=True)
    frame_start: int_property("Start", "First frame of the animation", default=1)
    frame_end: int_property("End", "Last frame of the animation", default=250)
    frame_step: int_property("Step", "Frames from one that is taken to the next", default=1, min=1)

    def invoke(self, context, event):
        scene = context.scene
        self.frame_start, self.frame_end = scene.frame_start, scene.frame_end
        return context.window_manager.invoke_props_dialog(self, width=360)

    def draw(self, context):
        animated = self.cameras != "OBJECTS"
        range_names = ["frame_start", "frame_end"] * (not self.whole_range)
        fields(self.layout, self, "cameras", *["whole_range", *range_names, "frame_step"] * animated)

    def work(self, context):
        from ...addon.bridge.own_scene.capture import capture_scene

        choices = context.scene.scan_relight
        chosen = self.result_folder or choices.result_folder
        folder = (
            Path(bpy.path.abspath(chosen)) / FOLDER
            if chosen
            else default_folders.capture_folder(preferences.results_folder(), choices.capture_folder)
        )
        first, last = (None, None) if self.whole_range else (self.frame_start, self.frame_end)
        default_folders.check(str(folder))
        warnings = capture_scene(context, folder, context.selected_objects, self.cameras, first, last, self.frame_step)
        choices.capture_folder = str(folder)
        self.report({"INFO"}, f"Captured into {folder}")
        return warnings
