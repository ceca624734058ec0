"""Our entries in Blender's own menus and bars: File > Import, and the progress of a run in the status bar."""

import bpy

from ..addon.core.kinds import Shown
from .base.job_operator import active, bar

NEED_MORE = ("restore_lamp", "select_result_object")
"""Operators that need an item of a list; all others are in the menu, where F3 finds them."""
WIDTH: Shown[int] = 14
"""Width of the bar, in units of the interface."""


class SCAN_RELIGHT_MT_all(bpy.types.Menu):
    """Object > Scan Relight: every operator that makes sense without a list; the search (F3) looks into menus."""

    bl_label = "Scan Relight"

    def draw(self, context):
        """One line each, in the order of registration; they ask for their properties."""
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        for name in names():
            layout.operator(f"scan_relight.{name}")


def names() -> list[str]:
    """The operators in the menu."""
    from . import classes

    operators = [cls for cls in classes() if issubclass(cls, bpy.types.Operator)]
    idnames = [cls.bl_idname.partition(".")[2] for cls in operators if "INTERNAL" not in getattr(cls, "bl_options", ())]
    return [name for name in idnames if name not in NEED_MORE]


def object_entry(menu, context) -> None:
    """Object > Scan Relight."""
    menu.layout.separator()
    menu.layout.menu(SCAN_RELIGHT_MT_all.bl_idname)


def import_entry(menu, context) -> None:
    """File > Import."""
    menu.layout.operator("scan_relight.open_capture", text="Scan Relight Capture")


def run_entry(header, context) -> None:
    """Each window's status bar, in any workspace; nothing while no run is going on, so nothing has to be cleared."""
    job = active()
    if job is None:
        return
    factor, text = bar(job)
    row = header.layout.row(align=True)
    part = row.row(align=True)
    part.ui_units_x = WIDTH
    part.progress(factor=factor, text=text)
    row.operator("scan_relight.stop", text="", icon="CANCEL")


def register() -> None:
    """Add the entries."""
    from bl_ui.space_statusbar import STATUSBAR_HT_header

    bpy.types.TOPBAR_MT_file_import.append(import_entry)
    bpy.types.VIEW3D_MT_object.append(object_entry)
    bpy.types.STATUSBAR_HT_header.append(run_entry)
    # `WorkSpace.status_text_set` restores the draw function that it first stored: clear that, or our entry is lost.
    if "_draw_orig" in vars(STATUSBAR_HT_header):
        del STATUSBAR_HT_header._draw_orig


def unregister() -> None:
    """Remove them."""
    bpy.types.STATUSBAR_HT_header.remove(run_entry)
    bpy.types.VIEW3D_MT_object.remove(object_entry)
    bpy.types.TOPBAR_MT_file_import.remove(import_entry)
