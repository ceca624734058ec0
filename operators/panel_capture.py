"""The tab's first part: which capture, what was found in it, and what is wrong with it."""

from __future__ import annotations

import bpy

from .panel import SidebarPanel


class SCAN_RELIGHT_PT_capture(SidebarPanel, bpy.types.Panel):
    """Choose a capture and see what it holds."""

    bl_idname = "SCAN_RELIGHT_PT_capture"
    bl_label = "Capture"
    bl_order = 0

    def draw(self, context):
        """The folder, and what was found there."""
        layout = self.layout
        layout.prop(context.scene.scan_relight, "capture_folder", text="")
