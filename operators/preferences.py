"""The add-on's preferences: where runs are kept, and what of the machine they may take."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import hashlib
import threading
import time
from pathlib import Path

import bpy

PACKAGE = __package__.rpartition(".")[0]
"""The root package, under whatever name Blender installed it."""


class ScanRelightPreferences(bpy.types.AddonPreferences):
    """Preferences, Add-ons, Scan Relight."""

    bl_idname = PACKAGE

    cache_folder: bpy.props.StringProperty(
        name="Cache Folder", description="Where runs go whose result folder is not chosen; empty takes a folder of "
        "Blender's own", subtype="DIR_PATH")
    threads: bpy.props.IntProperty(
        name="Threads", description="Processor threads that a run may take; 0 takes all", min=0, soft_max=64)
    memory_limit: bpy.props.FloatProperty(
        name="Memory Limit (GB)", description="Memory that a run may take before it is stopped; 0 sets no limit. A run "
        "is a process of its own: Blender's own memory does not count", min=0.0, soft_max=256.0, precision=1)

    def draw(self, context):
        """The choices."""
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(self, "cache_folder")
        row = layout.row()
        row.label(text=cache_text(), icon="FILE_CACHE")
        row.operator("scan_relight.clear_cache", icon="TRASH")
        layout.prop(self, "threads")
        layout.prop(self, "memory_limit")


def preferences() -> ScanRelightPreferences | None:
    """The add-on's preferences; None where it is registered without being enabled (tests)."""
    found = bpy.context.preferences.addons.get(PACKAGE)
    return found.preferences if found else None


def cache_folder() -> Path:
    """Where runs go whose result folder was not chosen; not made here."""
    ours = preferences()
    if ours is not None and ours.cache_folder:
        return Path(bpy.path.abspath(ours.cache_folder))
    try:
        return Path(bpy.utils.extension_path_user(PACKAGE, path="cache"))
    except ValueError:  # not installed as an extension
        return Path(bpy.utils.user_resource("DATAFILES", path="scan_relight")) / "cache"


def result_folder(chosen: str, capture_folder: str) -> Path:
    """The result folder that `chosen` means for a capture: itself, or one in the cache where it is empty."""
    if chosen:
        return Path(bpy.path.abspath(chosen))
    capture = Path(bpy.path.abspath(capture_folder)).absolute()
    mark = hashlib.sha256(str(capture).encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return cache_folder() / f"{capture.name}-{mark}"


SIZE_SECONDS = 30.0
"""How old the cache's size may be that the preferences show."""
_size: dict = {"folder": None, "time": 0.0, "text": "", "thread": None}


def cache_text() -> str:
    """What the cache takes, as far as is known; it is added up in a thread, as there may be many files."""
    folder = cache_folder()
    thread = _size["thread"]
    if thread is not None and thread.is_alive():
        return "Adding up"
    if _size["folder"] == folder and time.monotonic() - _size["time"] < SIZE_SECONDS:
        return _size["text"]
    thread = _size["thread"] = threading.Thread(target=_add_up, args=(folder,), name="scan relight size", daemon=True)
    thread.start()
    if not bpy.app.background:
        bpy.app.timers.register(_show_size, first_interval=0.2)
    return "Adding up"


def forget_size() -> None:
    """Have the cache's size added up again."""
    _size["folder"] = None


def amount(size: int) -> str:
    """Bytes as people say them."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"


def _add_up(folder: Path) -> None:
    from ..addon.core.result_cache import results, size

    found = results(folder)
    text = f"{len(found)} result{'s' * (len(found) != 1)}, {amount(sum(size(one) for one in found))}, in {folder}"
    _size.update(folder=folder, time=time.monotonic(), text=text)


def _show_size() -> float | None:
    if _size["thread"] is not None and _size["thread"].is_alive():
        return 0.2
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PREFERENCES":
                area.tag_redraw()
    return None
