"""The tab's second part: settings, the run and its progress."""

from __future__ import annotations

import bpy

from .panel import SidebarPanel


class SCAN_RELIGHT_PT_recover(SidebarPanel, bpy.types.Panel):
    """Run the recovery."""

    bl_idname = "SCAN_RELIGHT_PT_recover"
    bl_label = "Recover"
    bl_order = 1

    def draw(self, context):
        """The choices and the run."""
        layout, choices = self.layout, context.scene.scan_relight
        layout.use_property_split = True
        layout.prop(choices, "preset")
        layout.prop(choices, "result_folder")
