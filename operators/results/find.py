"""`bpy.ops.scan_relight.*` for result folders: found after a move, cleared of their stages, their report opened."""

from pathlib import Path

import bpy

from ...addon.bridge.results import default_folders, find, images
from ...addon.core.errors import BadInputError
from .. import preferences
from ..base.operator import AtOnce, Choosing, needs, no_run
from ..base.panel import SidebarPanel
from ..base.properties import FOLDERS, folder_property
from . import summary

_messages: list[str] = []
"""Messages on results that were found when the open file was loaded."""


class SCAN_RELIGHT_OT_find_result(Choosing, AtOnce, bpy.types.Operator):
    """Choose where the result folder lies now: all pictures, objects and looks that came from it are pointed there"""

    bl_label = "Find It"

    missing: folder_property(
        "Missing", "The result folder that is gone; empty takes the first that is", "HIDDEN", "SKIP_SAVE"
    )
    directory: folder_property("Folder", "Where it lies now; the folder above or below will do", "SKIP_SAVE")
    filter_folder: FOLDERS

    def work(self, context):
        lost = self.wanted()
        if not self.directory:
            raise BadInputError("Choose the folder that the result lies in now.")
        new = find.find(lost, Path(bpy.path.abspath(self.directory)).absolute())
        count = find.repoint(lost.folder, new)
        for scene in bpy.data.scenes:
            choices = scene.scan_relight
            if choices.result_folder and Path(bpy.path.abspath(choices.result_folder)) == lost.folder:
                choices.result_folder = str(new)
        remaining = next((other for other in find.missing() if other.folder == new), None)
        self.report({"INFO"}, f"{count} picture{'s' * (count != 1)} found in '{new}'.")
        return [remaining.sentence] if remaining is not None else []

    def wanted(self) -> find.Missing:
        lost = find.missing()
        if self.missing:
            folder = Path(bpy.path.abspath(self.missing)).absolute()
            lost = [item for item in lost if item.folder == folder]
        if not lost:
            raise BadInputError("Nothing of a result is missing in this file.")
        return lost[0]


class SCAN_RELIGHT_PT_missing(SidebarPanel, bpy.types.Panel):
    """Missing results of the file, at the top of the tab."""

    bl_label = "Missing"
    bl_options = {"HIDE_HEADER"}
    bl_order = 0

    @classmethod
    def poll(cls, context):
        return context.scene is not None and bool(_messages or any(find.cached_state()))

    def draw(self, context):
        layout = self.layout
        missing, overtaken = find.cached_state()
        for lost in missing:
            self.say(layout, lost.sentence, "ERROR")
            layout.operator("scan_relight.find_result", icon="FILE_FOLDER").missing = str(lost.folder)
        for folder in overtaken:
            self.say(
                layout,
                f"'{folder.name}' was recovered anew with other textures since this file was saved: its objects show "
                "wrong colours here until the new result is brought in.",
                "ERROR",
            )
            layout.operator("scan_relight.open_result", text="Bring In", icon="IMPORT").folder = str(folder)
        for sentence in _messages:
            self.say(layout, sentence, "INFO")


@bpy.app.handlers.persistent
def look_for_results(*_) -> None:
    """A file was loaded: find results that were moved with it."""
    _messages[:] = find.search(preferences.results_folder())


@bpy.app.handlers.persistent
def keep_images(*arguments) -> None:
    """The file is about to be saved: protect the images that it uses from later runs."""
    path = next((argument for argument in arguments if isinstance(argument, str) and argument), bpy.data.filepath)
    if path:
        images.keep(Path(path))


@bpy.app.handlers.persistent
def clear_messages(*_) -> None:
    """The file was saved, with the new paths: the messages are obsolete."""
    _messages.clear()


def folders(scene: bpy.types.Scene | None) -> list[Path]:
    """The results whose stages can be cleared: in the results folder, beside the .blend, and the scene's own."""
    from ...addon.core.results.cache import results as results_below

    folder_beside = default_folders.folder_beside_file()
    own_folder = summary.folder_of(scene) if scene is not None else None
    return [
        *results_below(preferences.results_folder()),
        *(results_below(folder_beside) if folder_beside else ()),
        *([own_folder] if own_folder else ()),
    ]


@no_run
class SCAN_RELIGHT_OT_clear_cache(AtOnce, bpy.types.Operator):
    """Delete the finished stages that further runs would go on from: of the results in the results folder, beside this
    file, and of this scene's. The results themselves stay as they are"""

    bl_label = "Clear Stages"
    bl_options = {"REGISTER"}

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(
            self,
            event,
            title="Clear the finished stages?",
            message="Results stay as they are; a further run begins anew.",
            confirm_text="Clear",
            icon="QUESTION",
        )

    def work(self, context):
        from ...addon.core.results.cache import clear

        done = clear(folders(context.scene))
        preferences.forget_size()
        self.report(
            {"INFO"},
            f"{preferences.amount(done.freed)} of stages deleted; {done.results} "
            f"result{'s' * (done.results != 1)} kept.",
        )
        return done.left


def _page(context) -> Path | None:
    folder = summary.folder_of(context.scene) if context.scene else None
    return folder / summary.PAGE if folder is not None and (folder / summary.PAGE).is_file() else None


@needs(_page, "There is no report yet; run the recovery to its end first.")
class SCAN_RELIGHT_OT_open_report(bpy.types.Operator):
    """Open the page with figures, pictures and doubts of this result in the browser"""

    bl_label = "Open Report"

    def execute(self, context):
        """Open it; in the background only report its path."""
        page = _page(context)
        if bpy.app.background:
            self.report({"INFO"}, str(page))
            return {"FINISHED"}
        return bpy.ops.wm.path_open(filepath=str(page))
