"""`bpy.ops.scan_relight.export` and the tab's last part: the room as glTF or USD."""

from pathlib import Path

import bpy

from ...addon.bridge.export import export
from ...addon.core.errors import BadInputError
from ...addon.core.io.folder import capture_name
from ..base.operator import needs
from ..base.panel import SidebarPanel
from ..base.properties import bool_property, enum_property, file_property
from .base import SceneOperator

FORMATS = (
    (".glb", "glTF (.glb)", "One file; most viewers and game engines"),
    (".gltf", "glTF (.gltf)", "A text file with its pictures beside it"),
    (".usdc", "USD (.usdc)", "With its pictures beside it"),
    (".usdz", "USD (.usdz)", "One file"),
)
SCOPES = (
    ("ROOM", "Room", "What was scanned and what was set into it"),
    ("SELECTED", "Selected", "The selected objects"),
    ("ALL", "All", "Every object that renders"),
)


@needs(lambda context: any(obj.type == "MESH" for obj in context.scene.objects), "The scene has no mesh to export.")
class SCAN_RELIGHT_OT_export(SceneOperator, bpy.types.Operator):
    """Write the room with plain materials that other programs understand; the scene stays as it is"""

    bl_label = "Export Room"
    bl_options = {"REGISTER", "PRESET"}

    filepath: file_property("File", "What to write", "SKIP_SAVE")
    filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf;*.usd*", options={"HIDDEN"})
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    format: enum_property("Format", "Of a file whose name has no ending", FORMATS)
    scope: enum_property("Objects", "What is written", SCOPES)
    lights: bool_property("Lights", "Also the lights that were added", default=True)
    cameras: bool_property("Camera", "Also the scene's camera")

    def invoke(self, context, event):
        if not self.filepath:
            folder = bpy.path.abspath(context.scene.scan_relight.result_folder or "//")  # '' where no file was saved
            self.filepath = str(Path(folder, capture_name(folder) + self.format)) if folder else f"room{self.format}"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context):
        if not self.filepath:
            raise BadInputError("Choose the file to write first.")
        path = Path(bpy.path.abspath(self.filepath))
        if path.suffix.lower() not in export.FORMATS:
            path = path.with_name(path.name + self.format)
        warnings = export.export(context.scene, path, self.scope, self.lights, self.cameras)
        self.report({"INFO"}, f"Exported '{path}'.")
        return warnings


class SCAN_RELIGHT_PT_export(SidebarPanel, bpy.types.Panel):
    """Export the room."""

    bl_label = "Export"
    manual = "relighting#export"
    bl_order = 5
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        for extension, text, _ in FORMATS:
            problem = export.can_export(extension)
            row = layout.row()
            row.enabled = not problem
            row.operator("scan_relight.export", text=text, icon="EXPORT").format = extension
        for problem in dict.fromkeys(export.can_export(extension) for extension, _, _ in FORMATS):
            if problem:
                self.say(layout, problem, "INFO")
        self.say(layout, "Pictures become 8-bit sRGB, materials plain: what other programs understand.")
