"""The tab's fourth part: what the viewport shows; and the scene of one's own as a capture, with the way back."""

from __future__ import annotations

import bpy

from ...addon.bridge.results import look
from ..base.panel import SidebarPanel


class SCAN_RELIGHT_PT_look(SidebarPanel, bpy.types.Panel):
    """What the viewport shows on the recovered objects."""

    bl_idname = "SCAN_RELIGHT_PT_look"
    bl_label = "Look"
    manual = "panel#look"
    bl_order = 3

    def draw(self, context):
        """One button a look."""
        layout, scene = self.layout, context.scene
        if not look.recovered(scene):
            self.say(
                layout,
                context,
                "Shows albedo, light and coverage in the viewport, once materials are recovered.",
                "INFO",
            )
            return
        shown = look.current(scene)
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for name, one in look.LOOKS.items():
            grid.operator("scan_relight.look", text=one.label, depress=name == shown).look = name
        if shown == look.MATERIAL:
            return
        self.say(layout, context, f"{look.LOOKS[shown].text}.")
        self.say(layout, context, "Renders show the materials all the same.", "RESTRICT_RENDER_OFF")
        if scene.view_settings.view_transform not in ("Standard", "Raw") and not look.LOOKS[shown].light:
            self.say(
                layout,
                context,
                "Colours are exact under the view transform Standard (Render, Color Management).",
                "INFO",
            )
        space = context.space_data
        if space is not None and space.type == "VIEW_3D" and space.shading.type in ("SOLID", "WIREFRAME"):
            self.say(layout, context, "Visible in Material Preview.", "INFO")


class SCAN_RELIGHT_PT_own_scene(SidebarPanel, bpy.types.Panel):
    """The open scene as a capture."""

    bl_idname = "SCAN_RELIGHT_PT_own_scene"
    bl_parent_id = "SCAN_RELIGHT_PT_capture"
    bl_label = "This Scene"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Capture, copies, restore."""
        layout, choices = self.layout, context.scene.scan_relight
        self.say(layout, context, "Select the room's objects; the EXR pictures behind the cameras are the frames.")
        layout.operator("scan_relight.capture_from_scene", icon="SCENE_DATA")
        column = layout.column()
        column.use_property_split, column.use_property_decorate = True, False
        column.prop(choices, "copies")
        layout.operator("scan_relight.restore_materials", icon="LOOP_BACK")
