"""The tab's first part: the capture, its content, and warnings."""

import bpy

from ...addon.bridge.job import job as jobs
from ...addon.core.kinds import Shown
from ...addon.core.naming import object_name
from ..base.panel import SidebarPanel, fields, folded
from . import findings, reading_props

MAX_LISTED: Shown[int] = 12
"""Maximum number of objects that are listed; the others are counted."""
KNOWN_FACTS = (
    "capture format triangles vertices area_m2 bounds_m extent_m frames resolutions masks instances warnings".split()
)


class SCAN_RELIGHT_PT_capture(SidebarPanel, bpy.types.Panel):
    """Choose a capture and see what it holds."""

    bl_label = "Capture"
    manual = "panel#capture"
    bl_order = 0

    def draw(self, context):
        layout, choices = self.layout, context.scene.scan_relight
        layout.prop(choices, "capture_folder", text="")
        if not choices.capture_folder:
            self.say(layout, "Choose the folder of a scan: its mesh, its HDR frames and their poses.", "INFO")
        if body := folded(layout, "reading", "How it is read"):
            fields(body, choices.reading, *reading_props.visible_names(choices.reading))
        wrong = findings.wrong_folder(choices)
        if wrong is not None:
            self.wrong(layout, wrong)
            return
        finding = findings.look(choices) if choices.capture_folder else None
        row = layout.row()
        row.enabled = not isinstance(finding, jobs.Job)
        row.operator("scan_relight.check_capture", text="Check" if finding is None else "Check Again", icon="VIEWZOOM")
        row.operator("scan_relight.run", text="Import", icon="IMPORT").target = "import_capture"
        if isinstance(finding, jobs.Job):
            layout.progress(factor=0.0, text="Reading the capture", type="RING")
        elif isinstance(finding, str):
            self.say(layout, finding, "CANCEL")
        elif finding is not None:
            self.facts(layout, finding)

    def wrong(self, layout, content) -> None:
        """Why the folder is no capture, and a button for each folder that may be meant."""
        column = layout.column()
        self.say(column, content.sentence, "INFO" if content.captures or content.results else "CANCEL")
        for folder in content.captures:
            column.operator(
                "scan_relight.use_folder", text=f"Use '{folder.name}'", icon="FILE_FOLDER", translate=False
            ).folder = str(folder)
        for folder in content.results:
            text = "Open It" if folder == content.folder else f"Open Result '{folder.name}'"
            column.operator("scan_relight.open_result", text=text, icon="IMPORT").folder = str(folder)

    def facts(self, layout, facts: dict) -> None:
        """The facts of `describe` on a capture; unknown keys are shown as they are."""
        warnings = facts.get("warnings", ())
        if not warnings:
            self.say(layout, "Nothing is wrong with it.", "CHECKMARK")
        for sentence in warnings:
            self.say(layout, sentence, "ERROR")
        sizes = ", ".join(f"{count} of {size}" for size, count in facts.get("resolutions", {}).items())
        masks = f", {facts['masks']} with a mask" if facts.get("masks") else ""
        self.say(layout, f"{facts.get('frames', 0)} frames ({facts.get('format', '')}): {sizes}{masks}", "CAMERA_DATA")
        extent = " x ".join(f"{length:.2f}" for length in facts.get("extent_m", ()))
        self.say(
            layout,
            f"{facts.get('triangles', 0):,} triangles, {facts.get('area_m2', 0):.1f} m\u00b2, {extent} m",
            "MESH_DATA",
        )
        for name, value in facts.items():
            if name not in KNOWN_FACTS:
                self.other(layout, name, value)
        instances = facts.get("instances", ())
        if body := folded(layout, "objects", f"{len(instances)} objects"):
            column = body.column(align=True)
            column.scale_y = 0.8
            for entry in instances[:MAX_LISTED]:
                column.label(
                    text=f"{object_name(entry['class_name'], entry['object_id'])}: {entry['triangles']:,} triangles"
                )
            if len(instances) > MAX_LISTED:
                column.label(text=f"and {len(instances) - MAX_LISTED} more")

    def other(self, layout, name: str, value) -> None:
        """A fact added by a reader."""
        label = name.replace("_", " ").capitalize()
        if isinstance(value, (list, tuple)) and all(isinstance(item, str) for item in value):
            for sentence in value:
                self.say(layout, sentence, "INFO")
        elif isinstance(value, (str, int, float)) and value not in ("", 0, None) and not isinstance(value, bool):
            self.say(layout, f"{label}: {value}", "INFO")


class SCAN_RELIGHT_PT_own_scene(SidebarPanel, bpy.types.Panel):
    """The open scene as a capture."""

    bl_parent_id = "SCAN_RELIGHT_PT_capture"
    bl_label = "This Scene"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, choices = self.layout, context.scene.scan_relight
        self.say(layout, "Select the room's objects; the EXR pictures behind the cameras are the frames.")
        layout.operator("scan_relight.capture_from_scene", icon="SCENE_DATA")
        fields(layout.column(), choices, "copies")
        layout.operator("scan_relight.restore_materials", icon="LOOP_BACK")
