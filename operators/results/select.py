"""`bpy.ops.scan_relight.select_result_object`: from a line of the results to the object in the scene."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.marks import OBJECT_ID
from ...addon.core.errors import BadInputError
from ..base import poll
from ..base.at_once import AtOnce


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


def select(context, thing: bpy.types.Object, extend: bool = False) -> None:
    """Select an object and make it the active one; raises `BadInputError` where it can't be."""
    if thing.name not in context.view_layer.objects:
        raise BadInputError(f"Object '{thing.name}' is not in this view layer; include its collection first.")
    if not thing.visible_get():
        raise BadInputError(f"Object '{thing.name}' is hidden; show it first.")
    make_active(context, thing, extend)


@poll.object_mode
@poll.has_scene
class SCAN_RELIGHT_OT_select_result_object(AtOnce, bpy.types.Operator):
    """Select this object in the scene"""

    bl_idname = "scan_relight.select_result_object"
    bl_label = "Select Object"

    object_id: bpy.props.IntProperty(name="Object", description="Number of the object in the capture", min=0)
    extend: bpy.props.BoolProperty(
        name="Extend", description="Keep what is selected", default=False, options={"SKIP_SAVE"}
    )

    def work(self, context):
        thing = result_objects(context.scene).get(self.object_id)
        if thing is None:
            raise BadInputError(f"Object {self.object_id} is not in this scene; import the capture first.")
        select(context, thing, self.extend)
