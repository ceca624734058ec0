"""`bpy.ops.scan_relight.find_result`: a result that was moved is pointed to anew; what a file misses is told."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from pathlib import Path

import bpy

from ...addon.bridge.results import find, images
from ...addon.core.errors import BadInputError
from .. import preferences
from ..base.at_once import AtOnce
from ..base.panel import SidebarPanel

_found: list[str] = []
"""What was found again when the open file was loaded."""


class SCAN_RELIGHT_OT_find_result(AtOnce, bpy.types.Operator):
    """Choose where the result folder lies now: all pictures, objects and looks that came from it are pointed there"""

    bl_idname = "scan_relight.find_result"
    bl_label = "Find It"

    missing: bpy.props.StringProperty(
        name="Missing",
        description="The result folder that is gone; empty takes the first that is",
        subtype="DIR_PATH",
        options={"HIDDEN", "SKIP_SAVE"},
    )
    directory: bpy.props.StringProperty(
        name="Folder",
        description="Where it lies now; the folder above or below will do",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    filter_folder: bpy.props.BoolProperty(
        name="Folders", description="Show folders", default=True, options={"HIDDEN", "SKIP_SAVE"}
    )

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context):
        one = self.wanted()
        if not self.directory:
            raise BadInputError("Choose the folder that the result lies in now.")
        new = find.find(one, Path(bpy.path.abspath(self.directory)).absolute())
        count = find.repoint(one.folder, new)
        for scene in bpy.data.scenes:
            choices = scene.scan_relight
            if choices.result_folder and Path(bpy.path.abspath(choices.result_folder)) == one.folder:
                choices.result_folder = str(new)
        left = next((other for other in find.missing() if other.folder == new), None)
        self.report({"INFO"}, f"{count} picture{'s' * (count != 1)} found in '{new}'.")
        return [left.sentence] if left is not None else []

    def wanted(self) -> find.Missing:
        """The missing result in question."""
        lost = find.missing()
        if self.missing:
            folder = Path(bpy.path.abspath(self.missing)).absolute()
            lost = [one for one in lost if one.folder == folder]
        if not lost:
            raise BadInputError("Nothing of a result is missing in this file.")
        return lost[0]


class SCAN_RELIGHT_PT_missing(SidebarPanel, bpy.types.Panel):
    """What the file misses, above all else."""

    bl_label = "Missing"
    bl_options = {"HIDE_HEADER"}
    bl_order = 0

    @classmethod
    def poll(cls, context):
        return context.scene is not None and bool(_found or find.known_missing() or find.known_overtaken())

    def draw(self, context):
        layout = self.layout
        for one in find.known_missing():
            self.say(layout, one.sentence, "ERROR")
            layout.operator("scan_relight.find_result", icon="FILE_FOLDER").missing = str(one.folder)
        for folder in find.known_overtaken():
            self.say(
                layout,
                f"'{folder.name}' was recovered anew with other textures since this file was saved: its objects show "
                "wrong colours here until the new result is brought in.",
                "ERROR",
            )
            layout.operator("scan_relight.open_result", text="Bring In", icon="IMPORT").folder = str(folder)
        for sentence in _found:
            self.say(layout, sentence, "INFO")


@bpy.app.handlers.persistent
def look_for_results(*_) -> None:
    """A file was opened: find what was moved along with it."""
    _found[:] = find.search(preferences.results_folder())


@bpy.app.handlers.persistent
def keep_images(*told) -> None:
    """The file is about to be saved: what it refers to of results is kept from later runs."""
    path = next((one for one in told if isinstance(one, str) and one), bpy.data.filepath)
    if path:
        images.keep(Path(path))


@bpy.app.handlers.persistent
def found_is_kept(*_) -> None:
    """The file was saved: what was found again is in it now."""
    _found.clear()
