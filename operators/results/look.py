"""`bpy.ops.scan_relight.look` and the tab's fourth part: what the viewport shows on the recovered objects."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.results import look
from ..base import poll
from ..base.at_once import AtOnce
from ..base.panel import SidebarPanel


def look_items() -> list[tuple[str, str, str]]:
    """Items of an enumeration of the looks."""
    return [(name, one.label, one.text) for name, one in look.LOOKS.items()]


needs_recovered = poll.needs(
    lambda context: context.scene is not None and look.recovered(context.scene),
    "No object of this scene wears recovered materials; run the recovery first.",
)


@poll.object_mode
@needs_recovered
class SCAN_RELIGHT_OT_look(AtOnce, bpy.types.Operator):
    """What the viewport shows on the recovered objects; renders and materials stay as they are"""

    bl_idname = "scan_relight.look"
    bl_label = "Show Look"

    look: bpy.props.EnumProperty(name="Look", description="What the viewport shows", items=look_items())
    switch_view: bpy.props.BoolProperty(
        name="Switch the View",
        description="Turn viewports that show no materials (Solid, Wireframe) to Material "
        "Preview, where the look can be seen",
        default=True,
    )

    @classmethod
    def description(cls, context, properties):
        return f"{look.LOOKS[properties.look].text}. Only the viewport changes, never a render"

    def work(self, context):
        look.set_look(context.scene, self.look)
        if self.switch_view and context.screen is not None:
            for area in context.screen.areas:
                if area.type == "VIEW_3D" and area.spaces.active.shading.type in ("SOLID", "WIREFRAME"):
                    area.spaces.active.shading.type = "MATERIAL"


class SCAN_RELIGHT_PT_look(SidebarPanel, bpy.types.Panel):
    """What the viewport shows on the recovered objects."""

    bl_label = "Look"
    manual = "panel#look"
    bl_order = 3

    def draw(self, context):
        layout, scene = self.layout, context.scene
        if not look.recovered(scene):
            self.say(layout, "Shows albedo, light and coverage in the viewport, once materials are recovered.", "INFO")
            return
        shown = look.current(scene)
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for name, one in look.LOOKS.items():
            grid.operator("scan_relight.look", text=one.label, depress=name == shown).look = name
        if shown == look.MATERIAL:
            return
        self.say(layout, f"{look.LOOKS[shown].text}.")
        self.say(layout, "Renders show the materials all the same.", "RESTRICT_RENDER_OFF")
        if scene.view_settings.view_transform not in ("Standard", "Raw") and not look.LOOKS[shown].light:
            self.say(layout, "Colours are exact under the view transform Standard (Render, Color Management).", "INFO")
        space = context.space_data
        if space is not None and space.type == "VIEW_3D" and space.shading.type in ("SOLID", "WIREFRAME"):
            self.say(layout, "Visible in Material Preview.", "INFO")
