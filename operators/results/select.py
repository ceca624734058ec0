"""`bpy.ops.scan_relight.select_result_object`: from a line of the results to the object in the scene."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.marks import OBJECT_ID
from ..base import poll


def result_objects(scene) -> dict[int, bpy.types.Object]:
    """The recovered objects of a scene by `object_id`; of several imports the last one's."""
    return {
        thing[OBJECT_ID]: thing
        for thing in scene.objects
        if thing.type == "MESH" and isinstance(thing.get(OBJECT_ID), int)
    }


def make_active(context, thing: bpy.types.Object, extend: bool = False) -> None:
    """Select an object, with `extend` beside what is selected, and make it the active one."""
    if not extend:
        for other in context.view_layer.objects.selected:
            other.select_set(False)
    thing.select_set(True)
    context.view_layer.objects.active = thing


def select(context, thing: bpy.types.Object, extend: bool = False) -> str:
    """Select an object and make it the active one; '' or the sentence that says why it can't be."""
    if thing.name not in context.view_layer.objects:
        return f"Object '{thing.name}' is not in this view layer; include its collection first."
    if not thing.visible_get():
        return f"Object '{thing.name}' is hidden; show it first."
    make_active(context, thing, extend)
    return ""


class SCAN_RELIGHT_OT_select_result_object(bpy.types.Operator):
    """Select a recovered object."""

    bl_idname = "scan_relight.select_result_object"
    bl_label = "Select Object"
    bl_description = "Select this object in the scene"
    bl_options = {"REGISTER", "UNDO"}

    object_id: bpy.props.IntProperty(name="Object", description="Number of the object in the capture", min=0)
    extend: bpy.props.BoolProperty(
        name="Extend", description="Keep what is selected", default=False, options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        """Only in object mode."""
        return poll.object_mode(cls, context) and context.scene is not None

    def execute(self, context):
        """Select it."""
        thing = result_objects(context.scene).get(self.object_id)
        if thing is None:
            self.report({"ERROR"}, f"Object {self.object_id} is not in this scene; import the capture first.")
            return {"CANCELLED"}
        sentence = select(context, thing, self.extend)
        if sentence:
            self.report({"ERROR"}, sentence)
            return {"CANCELLED"}
        return {"FINISHED"}
