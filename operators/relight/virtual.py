"""`bpy.ops.scan_relight.*` for things that were not scanned: add them, set them down, pick the place with the mouse."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy
from bpy_extras import view3d_utils

from ...addon.bridge.light.room import cast
from ...addon.bridge.marks import OBJECT_ID
from ...addon.bridge.relight import virtual_object as virtual
from ...addon.core.errors import ScanRelightError
from ..base import poll
from ..results.select import make_active
from ..translations import OWN
from .base import RelightOperator
from .props import LOOK, LOOKS, PLACES, SHAPE, SIZE


def surface(scene, place: str, ignored=None):
    """The surface that a choice of `PLACES` means."""
    return virtual.below_cursor(scene) if place == "CURSOR" else virtual.place_in_view(scene, ignored)


class SCAN_RELIGHT_OT_add_virtual(RelightOperator, bpy.types.Operator):
    """Set a simple thing into the room."""

    bl_idname = "scan_relight.add_virtual"
    bl_label = "Add Object"
    bl_description = "Set a simple object onto a surface of the room, in its light"

    shape: SHAPE
    look: LOOK
    size: SIZE
    place: bpy.props.EnumProperty(name="Place", description="Where it is set down", items=PLACES)

    def work(self, context):
        """Add it and make it the active object."""
        thing = virtual.add_virtual(context.scene, self.shape, self.size, self.look, surface(context.scene, self.place))
        make_active(context, thing)


class OwnObject(RelightOperator):
    """Works on the active object, which is not part of the scan."""

    @classmethod
    def poll(cls, context):
        """Only with such an object."""
        if not super().poll(context):
            return False
        thing = context.object
        return poll.check(
            cls,
            thing is not None and thing.type == "MESH" and OBJECT_ID not in thing,
            "Select an object of your own, not one of the scan.",
        )


class SCAN_RELIGHT_OT_place_object(OwnObject, bpy.types.Operator):
    """Set the active object down."""

    bl_idname = "scan_relight.place_object"
    bl_label = "Set Down"
    bl_description = "Set the active object onto a surface of the room; its size and rotation stay"

    place: bpy.props.EnumProperty(name="Place", description="Where it is set down", items=PLACES)

    def work(self, context):
        """Stand it there."""
        virtual.stand(context.scene, context.object, surface(context.scene, self.place, context.object))


class SCAN_RELIGHT_OT_virtual_look(OwnObject, bpy.types.Operator):
    """Give the active object a simple material."""

    bl_idname = "scan_relight.virtual_look"
    bl_label = "Give It This Material"
    bl_description = "Give the active object a simple material in place of its own"

    look: bpy.props.EnumProperty(name="Material", description="Which one", items=LOOKS, translation_context=OWN)

    def work(self, context):
        """Replace its materials."""
        virtual.set_look(context.object, self.look)


class SCAN_RELIGHT_OT_pick_place(OwnObject, bpy.types.Operator):
    """Set the active object down under the mouse."""

    bl_idname = "scan_relight.pick_place"
    bl_label = "Pick Place"
    bl_description = "Move the mouse over the room to set the active object down; click to leave it there, ESC to stop"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    def invoke(self, context, event):
        """Follow the mouse."""
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
        """Set it down wherever the mouse points."""
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
        for area in context.screen.areas:
            region = next((r for r in area.regions if r.type == "WINDOW"), None)
            if area.type != "VIEW_3D" or region is None:
                continue
            at = event.mouse_x - region.x, event.mouse_y - region.y
            if not (0 <= at[0] < region.width and 0 <= at[1] < region.height):
                continue
            view = area.spaces.active.region_3d
            origin = view3d_utils.region_2d_to_origin_3d(region, view, at)
            direction = view3d_utils.region_2d_to_vector_3d(region, view, at)
            thing.hide_viewport = True
            try:
                hit = cast(context.scene, origin, direction)
            finally:
                thing.hide_viewport = False
            if hit is not None:
                try:
                    virtual.stand(context.scene, thing, hit)
                except ScanRelightError:
                    pass  # nothing to stand on there: it stays where it was last
            return

    def _leave(self, context, verdict):
        context.workspace.status_text_set(None)
        return verdict
