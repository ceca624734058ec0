"""What the artist chose, kept in the scene: plain choices only. What a run does at the moment is nobody's to save."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
from dataclasses import replace

import bpy

from ..addon.core.settings import PRESETS, Settings
from ..addon.settings_info import setting_infos
from .settings_props import with_settings

PRESET_TEXTS = {
    "draft": "A first look: coarse texels, few rays",
    "normal": "Texels as fine as the frames, rays enough for most rooms",
    "fine": "Finer texels and three times the rays; takes several times as long",
    "paper": "The published method, for comparison; very slow",
}


def preset_items() -> list[tuple[str, str, str]]:
    """Items of an enumeration of the presets."""
    return [(name, name.capitalize(), PRESET_TEXTS.get(name, "")) for name in PRESETS]


def preset_chosen(choices, context) -> None:
    """Lay the preset's values into the settings, keeping what says how and not what is computed."""
    choices.settings.take(replace(PRESETS[choices.preset], threads=choices.settings.threads,
                                  seed=choices.settings.seed))


@with_settings
class ScanRelightSettings(bpy.types.PropertyGroup):
    """One property for each field of `Settings`."""

    def value(self) -> Settings:
        """The settings as chosen; raises `BadInputError` on one that can't be."""
        return Settings(**{info.name: getattr(self, info.name) for info in setting_infos()})

    def take(self, settings: Settings) -> None:
        """Show `settings`."""
        for info in setting_infos():
            setattr(self, info.name, getattr(settings, info.name))

    def changed(self, preset: str) -> list[str]:
        """Names of the settings that differ from the preset's."""
        wanted = PRESETS[preset]
        same = {bool: bool.__eq__, int: int.__eq__, str: str.__eq__, float: lambda a, b: abs(a - b) <= 1e-5}
        return [info.name for info in setting_infos()
                if info.name not in ("threads", "seed")
                and not same[info.kind](getattr(self, info.name), getattr(wanted, info.name))]


class ScanRelightScene(bpy.types.PropertyGroup):
    """`Scene.scan_relight`."""

    capture_folder: bpy.props.StringProperty(
        name="Capture", description="Folder of the scan: its mesh, its frames and their cameras", subtype="DIR_PATH")
    result_folder: bpy.props.StringProperty(
        name="Result", description="Folder for the recovered scene and the finished stages; empty takes one in the "
        "cache folder of the preferences", subtype="DIR_PATH")
    preset: bpy.props.EnumProperty(
        name="Preset", description="What all settings start from", items=preset_items(), default="normal",
        update=preset_chosen)
    settings: bpy.props.PointerProperty(type=ScanRelightSettings)
