"""The add-on's preferences: where results are stored, and how much of the machine a run may use."""

import threading
import time
from pathlib import Path

import bpy

from ..addon.bridge.results import default_folders
from ..addon.core.kinds import Shown
from . import keymaps
from .base.job_operator import areas
from .base.panel import fields
from .base.properties import float_property, folder_property, int_property

PACKAGE = default_folders.PACKAGE


class ScanRelightPreferences(bpy.types.AddonPreferences):
    """Preferences, Add-ons, Scan Relight."""

    bl_idname = PACKAGE

    results_folder: folder_property(
        "Results Folder",
        "Where results go whose folder is not chosen and whose .blend was never saved; empty takes 'Scan "
        "Relight' among your documents. A saved .blend has its results beside it",
    )
    threads: int_property("Threads", "Processor threads that a run may take; 0 takes all", min=0, soft_max=64)
    memory_limit: float_property(
        "Memory Limit (GB)",
        "Memory that a run keeps to, by working in smaller blocks; it is stopped where that can't be. 0 "
        "takes 70 % of what the machine has free. A run is a process of its own: Blender's own memory does not count",
        min=0.0,
        soft_max=256.0,
        precision=1,
    )

    def draw(self, context):
        layout = fields(self.layout, self, "results_folder")
        row = layout.row()
        row.label(text=size_text(), icon="FILE_FOLDER")
        row.operator("scan_relight.clear_cache", icon="TRASH")
        fields(layout, self, "threads", "memory_limit")
        keymaps.draw(layout, context)
        layout.operator("scan_relight.manual", icon="HELP")


def preferences() -> ScanRelightPreferences | None:
    """The add-on's preferences; None where it is registered without being enabled (tests)."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon.preferences if addon else None


def results_folder() -> Path:
    """The folder of results without a chosen one whose .blend was never saved; not created here."""
    return default_folders.results_folder(getattr(preferences(), "results_folder", ""))


def result_folder(chosen: str, capture_folder: str, scene: bpy.types.Scene | None = None) -> Path:
    """The result folder of a capture: `chosen`, or where that is empty the default."""
    if chosen:
        return Path(bpy.path.abspath(chosen))
    return default_folders.result_folder(Path(bpy.path.abspath(capture_folder)).absolute(), results_folder(), scene)


def chosen_result(scene: bpy.types.Scene) -> Path | None:
    """The result folder of the capture that a scene's panel has chosen; None where it has none."""
    choices = scene.scan_relight
    return result_folder(choices.result_folder, choices.capture_folder, scene) if choices.capture_folder else None


SIZE_SECONDS: Shown[float] = 30.0
"""Maximum age of the size that the preferences show."""
_size: dict = {"folder": None, "time": 0.0, "text": "", "thread": None}


def size_text() -> str:
    """Disk space of the results, if known; it is computed in a thread, as there may be many files."""
    folder = results_folder()
    thread = _size["thread"]
    if thread is not None and thread.is_alive():
        return "Adding up"
    if _size["folder"] == folder and time.monotonic() - _size["time"] < SIZE_SECONDS:
        return _size["text"]
    thread = _size["thread"] = threading.Thread(
        target=_compute_size, args=(folder,), name="scan relight size", daemon=True
    )
    thread.start()
    if not bpy.app.background:
        bpy.app.timers.register(_show_size, first_interval=0.2)
    return "Adding up"


def forget_size() -> None:
    """Have the size computed again."""
    _size["folder"] = None


def amount(size: int) -> str:
    """Bytes in GB or MB."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"


def _compute_size(folder: Path) -> None:
    from ..addon.core.results.cache import results, size
    from ..addon.core.results.store import STAGES

    folders = results(folder)
    total, stages = (sum(size(path / part) for path in folders) for part in ("", STAGES))
    text = (
        f"{len(folders)} result{'s' * (len(folders) != 1)}, {amount(total)}, of it {amount(stages)} that can be made "
        f"again, in {folder}"
    )
    _size.update(folder=folder, time=time.monotonic(), text=text)


def _show_size() -> float | None:
    if _size["thread"] is not None and _size["thread"].is_alive():
        return 0.2
    for area in areas(bpy.context, "PREFERENCES"):
        area.tag_redraw()
    return None
