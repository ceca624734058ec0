"""`bpy.ops.scan_relight.export`: the room as glTF or USD."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from pathlib import Path

import bpy

from ...addon.bridge.export import export
from ...addon.core.errors import BadInputError
from ...addon.core.results.room_file import capture_name
from ..base import poll
from .base import RelightOperator, default_folder

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


class SCAN_RELIGHT_OT_export(RelightOperator, bpy.types.Operator):
    """Take the room elsewhere."""

    bl_idname = "scan_relight.export"
    bl_label = "Export Room"
    bl_description = "Write the room with plain materials that other programs understand; the scene stays as it is"
    bl_options = {"REGISTER", "PRESET"}
    needs_room = False

    filepath: bpy.props.StringProperty(
        name="File", description="What to write", subtype="FILE_PATH", options={"SKIP_SAVE"}
    )
    filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf;*.usd*", options={"HIDDEN"})
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    format: bpy.props.EnumProperty(name="Format", description="Of a file whose name has no ending", items=FORMATS)
    scope: bpy.props.EnumProperty(name="Objects", description="What is written", items=SCOPES)
    lights: bpy.props.BoolProperty(name="Lights", description="Also the lights that were added", default=True)
    cameras: bpy.props.BoolProperty(name="Camera", description="Also the scene's camera", default=False)

    @classmethod
    def poll(cls, context):
        """Something to export."""
        return super().poll(context) and poll.check(
            cls, any(thing.type == "MESH" for thing in context.scene.objects), "The scene has no mesh to export."
        )

    def invoke(self, context, event):
        """Choose the file."""
        if not self.filepath:
            folder = default_folder(context.scene)
            self.filepath = str(Path(folder, capture_name(folder) + self.format)) if folder else f"room{self.format}"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context):
        """Export; what the format can't hold is told."""
        if not self.filepath:
            raise BadInputError("Choose the file to write first.")
        path = Path(bpy.path.abspath(self.filepath))
        if path.suffix.lower() not in export.FORMATS:
            path = path.with_name(path.name + self.format)
        told = export.export(context.scene, path, self.scope, self.lights, self.cameras)
        self.report({"INFO"}, f"Exported '{path}'.")
        return told
