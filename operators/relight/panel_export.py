"""The tab's last part: the room for other programs."""

from __future__ import annotations

import bpy

from ...addon.bridge.export import export
from ..base.panel import SidebarPanel
from .export import FORMATS


class SCAN_RELIGHT_PT_export(SidebarPanel, bpy.types.Panel):
    """Take the room elsewhere."""

    bl_idname = "SCAN_RELIGHT_PT_export"
    bl_label = "Export"
    manual = "relighting#export"
    bl_order = 5
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """One button for each format."""
        layout = self.layout
        for ending, text, _ in FORMATS:
            problem = export.can_export(ending)
            row = layout.row()
            row.enabled = not problem
            row.operator("scan_relight.export", text=text, icon="EXPORT").format = ending
        for problem in dict.fromkeys(export.can_export(ending) for ending, _, _ in FORMATS):
            if problem:
                self.say(layout, context, problem, "INFO")
        self.say(layout, context, "Pictures become 8-bit sRGB, materials plain: what other programs understand.")
