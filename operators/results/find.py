"""`bpy.ops.scan_relight.*` for result folders: found again after a move, freed of their stages, opened as a page."""

from pathlib import Path

import bpy

from ...addon.bridge.results import find, home, images
from ...addon.core.errors import BadInputError
from .. import preferences
from ..base.operator import FOLDERS, AtOnce, Choosing, folder_property, needs, no_run
from ..base.panel import SidebarPanel
from . import told

_found: list[str] = []
"""What was found again when the open file was loaded."""


class SCAN_RELIGHT_OT_find_result(Choosing, AtOnce, bpy.types.Operator):
    """Choose where the result folder lies now: all pictures, objects and looks that came from it are pointed there"""

    bl_label = "Find It"

    missing: folder_property(
        "Missing", "The result folder that is gone; empty takes the first that is", "HIDDEN", "SKIP_SAVE"
    )
    directory: folder_property("Folder", "Where it lies now; the folder above or below will do", "SKIP_SAVE")
    filter_folder: FOLDERS

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
        return context.scene is not None and bool(_found or any(find.cached_state()))

    def draw(self, context):
        layout = self.layout
        missing, overtaken = find.cached_state()
        for one in missing:
            self.say(layout, one.sentence, "ERROR")
            layout.operator("scan_relight.find_result", icon="FILE_FOLDER").missing = str(one.folder)
        for folder in overtaken:
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


def folders(scene: bpy.types.Scene | None) -> list[Path]:
    """The results whose stages can be cleared: in the results folder, beside the .blend, and the scene's own."""
    from ...addon.core.results.cache import results as below

    beside = home.folder_beside_file()
    own = told.folder_of(scene) if scene is not None else None
    return [*below(preferences.results_folder()), *(below(beside) if beside else ()), *([own] if own else ())]


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
    folder = told.folder_of(context.scene) if context.scene else None
    return folder / told.PAGE if folder is not None and (folder / told.PAGE).is_file() else None


@needs(_page, "There is no report yet; run the recovery to its end first.")
class SCAN_RELIGHT_OT_open_report(bpy.types.Operator):
    """Open the page with figures, pictures and doubts of this result in the browser"""

    bl_label = "Open Report"

    def execute(self, context):
        """Open it; in the background only say where it lies."""
        page = _page(context)
        if bpy.app.background:
            self.report({"INFO"}, str(page))
            return {"FINISHED"}
        return bpy.ops.wm.path_open(filepath=str(page))
