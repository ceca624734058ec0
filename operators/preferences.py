"""The add-on's preferences: where runs are kept, and what of the machine they may take."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import hashlib
from pathlib import Path

import bpy

PACKAGE = __package__.rpartition(".")[0]
"""The root package, under whatever name Blender installed it."""


class ScanRelightPreferences(bpy.types.AddonPreferences):
    """Preferences, Add-ons, Scan Relight."""

    bl_idname = PACKAGE

    cache_folder: bpy.props.StringProperty(
        name="Cache folder", description="Where runs go whose result folder is not chosen; empty takes a folder of "
        "Blender's own", subtype="DIR_PATH")
    threads: bpy.props.IntProperty(
        name="Threads", description="Processor threads that a run may take; 0 takes all", min=0, soft_max=64)
    memory_limit: bpy.props.FloatProperty(
        name="Memory limit", description="Gigabytes that a run may take before it is stopped; 0 sets no limit",
        min=0.0, soft_max=256.0, precision=1)

    def draw(self, context):
        """The choices."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "cache_folder")
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
