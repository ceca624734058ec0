"""Where Blender's own menus and bars tell of us: File > Import, and the progress of a run in the status bar."""

from __future__ import annotations

import bpy

from .job_operator import active, bar

WIDTH = 14
"""Of the bar, in units of the interface."""


def import_entry(menu, context) -> None:
    """File > Import."""
    menu.layout.operator("scan_relight.open_capture", text="Scan Relight Capture")


def run_entry(header, context) -> None:
    """Each window's status bar, in any workspace; nothing where no run goes on, so nothing has to be cleared."""
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
    bpy.types.STATUSBAR_HT_header.append(run_entry)
    # `WorkSpace.status_text_set` puts back the bar's drawing as it first found it: have it look again, or ours is lost.
    if "_draw_orig" in vars(STATUSBAR_HT_header):
        del STATUSBAR_HT_header._draw_orig


def unregister() -> None:
    """Take them back."""
    bpy.types.STATUSBAR_HT_header.remove(run_entry)
    bpy.types.TOPBAR_MT_file_import.remove(import_entry)
