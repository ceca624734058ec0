"""`bpy.ops.scan_relight.look`: what the viewport shows on the recovered objects."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.results import look
from ..base import poll
from ..base.at_once import AtOnce


def look_items() -> list[tuple[str, str, str]]:
    """Items of an enumeration of the looks."""
    return [(name, one.label, one.text) for name, one in look.LOOKS.items()]


class SCAN_RELIGHT_OT_look(AtOnce, bpy.types.Operator):
    """Show another look of the recovered objects."""

    bl_idname = "scan_relight.look"
    bl_label = "Show Look"
    bl_description = "What the viewport shows on the recovered objects; renders and materials stay as they are"
    bl_options = {"REGISTER", "UNDO"}

    look: bpy.props.EnumProperty(name="Look", description="What the viewport shows", items=look_items())
    switch_view: bpy.props.BoolProperty(
        name="Switch the View",
        description="Turn viewports that show no materials (Solid, Wireframe) to Material "
        "Preview, where the look can be seen",
        default=True,
    )

    @classmethod
    def description(cls, context, properties):
        """The tooltip of the chosen look."""
        return f"{look.LOOKS[properties.look].text}. Only the viewport changes, never a render"

    @classmethod
    def poll(cls, context):
        """Whether anything recovered is there."""
        return poll.check(
            cls,
            context.scene is not None and bool(look.recovered(context.scene)),
            "No object of this scene wears recovered materials; run the recovery first.",
        ) and poll.object_mode(cls, context)

    def work(self, context):
        """Switch."""
        look.set_look(context.scene, self.look)
        if self.switch_view and context.screen is not None:
            for area in context.screen.areas:
                if area.type == "VIEW_3D" and area.spaces.active.shading.type in ("SOLID", "WIREFRAME"):
                    area.spaces.active.shading.type = "MATERIAL"
