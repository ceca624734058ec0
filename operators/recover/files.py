"""`bpy.ops.scan_relight.*` for files on disk: File > Import, dropped files, finished results."""

from functools import partial
from pathlib import Path

import bpy

from ...addon.core.errors import BadInputError
from ...addon.core.io import folder as folders
from ..base.operator import AtOnce, Choosing, OneSentence, free_scene, has_scene, no_run
from ..base.panel import SidebarPanel, fields
from ..base.properties import FOLDERS, enum_property, file_property, folder_property, string_property
from . import room
from .settings_props import preset_property

NEXT = (
    ("CHOOSE", "Choose Only", "Choose it in the sidebar; the panel shows what is in it"),
    ("IMPORT", "Import", "Bring objects, cameras and frames into the scene as they were scanned"),
    ("RUN", "Recover", "Run the recovery beside this window"),
)
FILTER = "transforms*.json;materials.json;*.ply;*.obj;*.glb;*.gltf;cameras.bin;cameras.txt;odometry.csv;scene.blend"


def show_tab(context) -> None:
    """Open the sidebar of the window's 3D views on our tab."""
    for area in context.screen.areas if context.screen else ():
        if area.type != "VIEW_3D":
            continue
        area.spaces.active.show_region_ui = True
        if not _to_front(area) and not bpy.app.background:
            bpy.app.timers.register(partial(_later, context.window, area.as_pointer()), first_interval=0.1)


def _to_front(area) -> bool:
    """Show our tab in an area's sidebar; one that was never drawn has no tabs yet. Returns whether it could."""
    region = next((item for item in area.regions if item.type == "UI"), None)
    try:
        region.active_panel_category = SidebarPanel.bl_category
    except (AttributeError, TypeError):
        return False
    return True


def _later(window, pointer: int) -> None:
    """Try again after the sidebar was drawn; windows and areas may have been closed by then."""
    if window in bpy.context.window_manager.windows[:]:
        for area in window.screen.areas:
            if area.as_pointer() == pointer:
                _to_front(area)


def given_path(operator) -> Path:
    """The path in the properties that Blender fills: `filepath`, or `directory` with the first of `files`."""
    if operator.filepath:
        return Path(bpy.path.abspath(operator.filepath))
    names = [item.name for item in operator.files if item.name]
    if operator.directory:
        return Path(bpy.path.abspath(operator.directory), *names[:1])
    raise BadInputError("Choose the folder of a scan first, or one of its files.")


@free_scene
class FileOperator(OneSentence):
    """Takes a path to a scan or to a result; errors become one sentence."""

    filepath: file_property("File or Folder", "Folder of a scan or of a result, or a file in one", "SKIP_SAVE")
    directory: folder_property("Folder", "Folder that the files lie in", "HIDDEN", "SKIP_SAVE")
    files: bpy.props.CollectionProperty(
        name="Files",
        description="Names of files in the folder",
        type=bpy.types.OperatorFileListElement,
        options={"HIDDEN", "SKIP_SAVE"},
    )
    then: enum_property("Then", "What is done with a scan", NEXT)
    preset: preset_property("What all settings of a recovery start from")

    def execute(self, context):
        return self.attempt(lambda: self.open(context))

    def open(self, context) -> set[str]:
        """Open a result; or choose a scan, and do with it what `then` says."""
        content = folders.of_path(given_path(self))
        if content.kind == folders.RESULT:
            return bpy.ops.scan_relight.open_result(folder=str(content.folder))
        choose(context, content)
        if self.then == "CHOOSE":
            self.report({"INFO"}, f"Scan '{content.name}' is chosen; see the sidebar (N), tab 'Scan Relight'.")
            return {"FINISHED"}
        if self.properties.is_property_set("preset"):
            context.scene.scan_relight.preset = self.preset
        return bpy.ops.scan_relight.run(target="import_capture" if self.then == "IMPORT" else "recover")


def choose(context, content: folders.Content) -> None:
    """Choose a scan in the panel and show it; raises `BadInputError` for any other folder."""
    if content.kind == folders.WAY and len(content.captures) == 1 and not content.results:
        content = folders.look_into(content.captures[0])
    if content.kind != folders.CAPTURE:
        raise BadInputError(content.sentence)
    context.scene.scan_relight.capture_folder = str(content.folder)
    show_tab(context)


class SCAN_RELIGHT_OT_open_capture(Choosing, FileOperator, bpy.types.Operator):
    """Choose the folder of a scan, or of a finished result, by itself or by one of its files"""

    bl_label = "Import Scan Relight Capture"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filter_glob: string_property("Filter", "Which files are shown", default=FILTER, options={"HIDDEN"})

    def draw(self, context):
        layout = fields(self.layout)
        layout.prop(self, "then", expand=True)
        column = layout.column()
        column.enabled = self.then == "RUN"
        column.prop(self, "preset")


class SCAN_RELIGHT_OT_drop(FileOperator, bpy.types.Operator):
    """Choose the scan, or open the finished result, that the dropped file belongs to"""

    bl_label = "Open Scan or Result"
    bl_options = {"UNDO", "INTERNAL"}

    def invoke(self, context, event):
        return self.attempt(lambda: self.offer(context))

    def offer(self, context) -> set[str]:
        """Open a result at once; choose a scan and offer to run it."""
        content = folders.of_path(given_path(self))
        if content.kind == folders.RESULT:
            return self.execute(context)
        choose(context, content)
        self.then, self.preset = "RUN", context.scene.scan_relight.preset
        return context.window_manager.invoke_props_dialog(
            self, title=f"Recover '{content.name}'?", confirm_text="Run", width=320
        )

    def draw(self, context):
        self.layout.prop(self, "preset", expand=True)


class SCAN_RELIGHT_FH_json(bpy.types.FileHandler):
    """A scan's transforms.json or a result's materials.json dropped into a 3D view."""

    bl_label = "Scan Relight"
    bl_import_operator = "scan_relight.drop"
    bl_file_extensions = ".json"

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type == "VIEW_3D"


@no_run
@has_scene
class SCAN_RELIGHT_OT_use_folder(bpy.types.Operator):
    """Choose this folder as the capture"""

    bl_label = "Use This Folder"
    bl_options = {"UNDO", "INTERNAL"}

    folder: folder_property("Folder", "Folder of a scan")

    def execute(self, context):
        context.scene.scan_relight.capture_folder = self.folder
        return {"FINISHED"}


@free_scene
class SCAN_RELIGHT_OT_open_result(Choosing, AtOnce, bpy.types.Operator):
    """Bring the recovered room of a finished result into this file, as a scene of its own"""

    bl_label = "Open Scan Relight Result"
    given = "folder"

    folder: folder_property("Folder", "Result folder of a finished run", "SKIP_SAVE")
    directory: folder_property("Folder", "What the file browser chooses", "HIDDEN", "SKIP_SAVE")
    filter_folder: FOLDERS

    def work(self, context):
        folder = Path(bpy.path.abspath(self.folder or self.directory))
        if not (self.folder or self.directory):
            raise BadInputError("Choose the folder of a finished result first.")
        content = folders.of_path(folder)
        if content.kind != folders.RESULT:
            raise BadInputError(
                f"Folder '{folder.name}' holds no finished result; run the recovery to its end "
                "first, or choose another."
            )
        from ...addon.bridge.room.bring import bringing
        from ...addon.bridge.slices import whole

        brought = whole(bringing(content.folder))
        room.show(context.scene, brought.scene)
        brought.scene.scan_relight.result_folder = str(content.folder)
        show_tab(context)
        return brought.warnings
