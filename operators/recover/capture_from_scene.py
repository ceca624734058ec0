"""`bpy.ops.scan_relight.capture_from_scene`: the selected objects and the cameras' backgrounds become a capture."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from pathlib import Path

import bpy

from ...addon.bridge.results import home
from .. import preferences
from ..base import poll
from ..base.at_once import AtOnce
from .settings_props import startable

FOLDER = "scene_capture"


@poll.needs(
    lambda context: any(thing.type not in ("CAMERA", "LIGHT") for thing in context.selected_objects),
    "Select the objects of the room first.",
)
@startable
class SCAN_RELIGHT_OT_capture_from_scene(AtOnce, bpy.types.Operator):
    """Make a capture of the selected objects: their faces are the mesh, and the pictures behind the cameras (EXR) are
    the frames. Nothing in the scene is changed"""

    bl_idname = "scan_relight.capture_from_scene"
    bl_label = "Capture From Scene"

    result_folder: bpy.props.StringProperty(
        name="Result",
        description="The capture goes into a folder within this one; empty takes the panel's, or a "
        "folder of its own among the results",
        subtype="DIR_PATH",
    )
    cameras: bpy.props.EnumProperty(
        name="Frames",
        description="Which cameras took the pictures",
        items=[
            (
                "AUTO",
                "Automatic",
                "An animation where the only camera has a sequence or a clip behind it, else one frame for each camera",
            ),
            (
                "OBJECTS",
                "Each Camera",
                "One frame for each camera that has a picture behind it; only the selected "
                "cameras where some are selected",
            ),
            ("ANIMATION", "Animation", "One frame for each frame of the active camera's animation"),
        ],
    )
    whole_range: bpy.props.BoolProperty(name="Whole Range", description="Take the scene's frame range", default=True)
    frame_start: bpy.props.IntProperty(name="Start", description="First frame of the animation", default=1)
    frame_end: bpy.props.IntProperty(name="End", description="Last frame of the animation", default=250)
    frame_step: bpy.props.IntProperty(
        name="Step", description="Frames from one that is taken to the next", default=1, min=1
    )

    def invoke(self, context, event):
        scene = context.scene
        self.frame_start, self.frame_end = scene.frame_start, scene.frame_end
        return context.window_manager.invoke_props_dialog(self, width=360)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(self, "cameras")
        if self.cameras != "OBJECTS":
            layout.prop(self, "whole_range")
            if not self.whole_range:
                layout.prop(self, "frame_start")
                layout.prop(self, "frame_end")
            layout.prop(self, "frame_step")

    def work(self, context):
        from ...addon.bridge.own_scene.capture import capture_scene

        choices = context.scene.scan_relight
        chosen = self.result_folder or choices.result_folder
        folder = (
            Path(bpy.path.abspath(chosen)) / FOLDER
            if chosen
            else home.capture_folder(preferences.results_folder(), choices.capture_folder)
        )
        first, last = (None, None) if self.whole_range else (self.frame_start, self.frame_end)
        home.check(str(folder))
        told = capture_scene(context, folder, context.selected_objects, self.cameras, first, last, self.frame_step)
        choices.capture_folder = str(folder)
        self.report({"INFO"}, f"Captured into {folder}")
        return told
