"""`bpy.ops.scan_relight.*` for a known white: an object, or a spot under the mouse, fixes the whole room's scale."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy
from mathutils import Vector

from ...addon.bridge.corrections import corrections, known_white
from ...addon.bridge.light.room import cast, depsgraph_of
from ...addon.core.errors import BadInputError
from ..base import poll
from ..base.mouse import mouse_ray
from .base import RefitOperator, in_room, on_selected
from .props import ALBEDO


@on_selected
class SCAN_RELIGHT_OT_this_is_white(RefitOperator, bpy.types.Operator):
    """The active object's albedo is known: the albedo of the whole room is scaled with it, channel by channel, and with
    it the colour of the light"""

    bl_idname = "scan_relight.this_is_white"
    bl_label = "This Is White"

    albedo: ALBEDO
    asks_for = "albedo"

    def state(self, context, things):
        thing = context.view_layer.objects.active
        thing = thing if thing in things else things[0]
        corrections.say_white(thing, self.albedo)
        self.report(
            {"INFO"},
            f"The whole room's albedo is scaled so that '{thing.name}' has "
            f"{', '.join(f'{part:.2f}' for part in self.albedo)}",
        )
        return [thing]


@poll.needs(lambda context: corrections.white_of(context.view_layer.objects.active) is not None, "No white is given.")
@on_selected
class SCAN_RELIGHT_OT_white_back(RefitOperator, bpy.types.Operator):
    """Take back the known white: the frames alone say how bright the room's surfaces are"""

    bl_idname = "scan_relight.white_back"
    bl_label = "No Known White"

    def state(self, context, things):
        corrections.take_white_back(context.view_layer.objects.active)
        return things[:1]


@in_room
class SCAN_RELIGHT_OT_pick_white(RefitOperator, bpy.types.Operator):
    """Click on a spot of the room whose albedo is known, such as a grey card or white paint; the whole room's albedo is
    scaled with it. ESC stops"""

    bl_idname = "scan_relight.pick_white"
    bl_label = "Pick White Spot"

    albedo: ALBEDO
    origin: bpy.props.FloatVectorProperty(
        name="From",
        description="Where the ray to the spot begins, in metres",
        size=3,
        subtype="TRANSLATION",
        options={"SKIP_SAVE"},
    )
    direction: bpy.props.FloatVectorProperty(
        name="Direction", description="Of the ray to the spot", size=3, subtype="DIRECTION", options={"SKIP_SAVE"}
    )

    def invoke(self, context, event):
        self._picking = True
        context.window_manager.modal_handler_add(self)
        context.window.cursor_modal_set("EYEDROPPER")
        context.workspace.status_text_set("Click on the spot whose albedo is known   ESC or right click: stop")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if not getattr(self, "_picking", False):
            return super().modal(context, event)
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._end(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return (
                {"PASS_THROUGH"}
                if event.type in {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "TIMER"}
                else {"RUNNING_MODAL"}
            )
        ray = mouse_ray(context, event)
        if ray is None:
            return {"RUNNING_MODAL"}
        self._end(context)
        self.origin, self.direction = ray
        return self.execute(context)

    def state(self, context, things):
        hit = cast(context.scene, Vector(self.origin), Vector(self.direction)) if any(self.direction) else None
        if hit is None or not corrections.correctable(hit.thing):
            raise BadInputError("There is no recovered object at that spot; click on one.")
        albedo = known_white.of_object(hit.thing, hit.place, tuple(self.albedo), depsgraph_of(context.scene))
        corrections.say_white(hit.thing, albedo)
        self.report({"INFO"}, f"The whole room's albedo is scaled by that spot on '{hit.thing.name}'")
        return [hit.thing]

    def _end(self, context) -> None:
        self._picking = False
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)
