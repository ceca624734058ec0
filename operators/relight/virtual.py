"""`bpy.ops.scan_relight.*` for things that were not scanned: add them, set them down, pick the place with the mouse."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from contextlib import suppress

import bpy

from ...addon.bridge.light.room import cast
from ...addon.bridge.marks import OBJECT_ID
from ...addon.bridge.relight import virtual_object as virtual
from ...addon.core.errors import ScanRelightError
from ..base import poll
from ..base.mouse import mouse_ray
from ..results.select import make_active
from ..translations import OWN
from .base import RelightOperator
from .props import LOOK, LOOKS, PLACE, SHAPE, SIZE


def surface(scene, place: str, ignored=None):
    """The surface that a choice of `PLACES` means."""
    return virtual.below_cursor(scene) if place == "CURSOR" else virtual.place_in_view(scene, ignored)


class SCAN_RELIGHT_OT_add_virtual(RelightOperator, bpy.types.Operator):
    """Set a simple object onto a surface of the room, in its light"""

    bl_idname = "scan_relight.add_virtual"
    bl_label = "Add Object"

    shape: SHAPE
    look: LOOK
    size: SIZE
    place: PLACE

    def work(self, context):
        thing = virtual.add_virtual(context.scene, self.shape, self.size, self.look, surface(context.scene, self.place))
        make_active(context, thing)


def _is_own(context) -> bool:
    thing = context.object
    return thing is not None and thing.type == "MESH" and OBJECT_ID not in thing


@poll.needs(_is_own, "Select an object of your own, not one of the scan.")
class OwnObject(RelightOperator):
    """Works on the active object, which is not part of the scan."""


class SCAN_RELIGHT_OT_place_object(OwnObject, bpy.types.Operator):
    """Set the active object onto a surface of the room; its size and rotation stay"""

    bl_idname = "scan_relight.place_object"
    bl_label = "Set Down"

    place: PLACE

    def work(self, context):
        virtual.stand(context.scene, context.object, surface(context.scene, self.place, context.object))


class SCAN_RELIGHT_OT_virtual_look(OwnObject, bpy.types.Operator):
    """Give the active object a simple material in place of its own"""

    bl_idname = "scan_relight.virtual_look"
    bl_label = "Give It This Material"

    look: bpy.props.EnumProperty(name="Material", description="Which one", items=LOOKS, translation_context=OWN)

    def work(self, context):
        virtual.set_look(context.object, self.look)


class SCAN_RELIGHT_OT_pick_place(OwnObject, bpy.types.Operator):
    """Move the mouse over the room to set the active object down; click to leave it there, ESC to stop"""

    bl_idname = "scan_relight.pick_place"
    bl_label = "Pick Place"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    def invoke(self, context, event):
        if context.region is None or context.region_data is None:
            area = next((a for a in context.screen.areas if a.type == "VIEW_3D"), None) if context.screen else None
            if area is None:
                self.report({"ERROR"}, "There is no 3D view to pick in.")
                return {"CANCELLED"}
        self._thing, self._before = context.object.name, context.object.matrix_world.copy()
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Click: set down here   ESC or right click: back to where it was")
        return {"RUNNING_MODAL"}

    def work(self, context):
        """Without a mouse: in the middle of the view."""
        virtual.stand(context.scene, context.object)

    def modal(self, context, event):
        thing = context.scene.objects.get(self._thing)
        if thing is None or event.type in {"ESC", "RIGHTMOUSE"}:
            if thing is not None:
                thing.matrix_world = self._before
            return self._leave(context, {"CANCELLED"})
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            return self._leave(context, {"FINISHED"})
        if event.type == "MOUSEMOVE":
            self._move(context, thing, event)
            return {"RUNNING_MODAL"}
        turning = event.type in {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE"}
        return {"PASS_THROUGH"} if turning else {"RUNNING_MODAL"}

    def _move(self, context, thing, event):
        ray = mouse_ray(context, event)
        if ray is None:
            return
        thing.hide_viewport = True
        try:
            hit = cast(context.scene, *ray)
        finally:
            thing.hide_viewport = False
        if hit is not None:
            with suppress(ScanRelightError):  # nothing to stand on there: it stays where it was last
                virtual.stand(context.scene, thing, hit)

    def _leave(self, context, verdict):
        context.workspace.status_text_set(None)
        return verdict
