"""The artist's choices, stored in the scene: plain values only. The state of a run is not saved."""

from contextlib import suppress

import bpy

from ...addon.core.errors import StorageError
from ...addon.core.settings import PRESETS
from ...addon.settings_info import setting_infos
from ..base.properties import folder_property
from . import findings
from .reading_props import ReadingProps
from .settings_props import COPIES, IMAGES, SettingsProps, preset_property

NOT_IN_PRESETS = ("threads", "seed")
"""Settings that do not change what is computed, and so belong to no preset."""


def preset_chosen(choices, context) -> None:
    """Copy the preset's values into the settings."""
    for info in setting_infos():
        if info.name not in NOT_IN_PRESETS:
            setattr(choices.settings, info.name, getattr(PRESETS[choices.preset], info.name))


def capture_chosen(choices, context) -> None:
    """Read the folder at once, beside the window."""
    if choices.capture_folder and not bpy.app.background and findings.wrong_folder(choices) is None:
        with suppress(StorageError):  # then the button reports the error
            findings.begin(choices)


class ScanRelightSettings(SettingsProps, bpy.types.PropertyGroup):
    """The chosen settings."""

    def changed(self, preset: str) -> list[str]:
        """Names of the settings that differ from the preset's."""

        def differs(info) -> bool:
            value, preset_value = getattr(self, info.name), getattr(PRESETS[preset], info.name)
            return abs(value - preset_value) > 1e-5 if info.kind is float else value != preset_value

        return [info.name for info in setting_infos() if info.name not in NOT_IN_PRESETS and differs(info)]


class ScanRelightReading(ReadingProps, bpy.types.PropertyGroup):
    """How the capture is read."""


class ScanRelightScene(bpy.types.PropertyGroup):
    """`Scene.scan_relight`."""

    capture_folder: folder_property(
        "Capture", "Folder of the scan: its mesh, its frames and their cameras", update=capture_chosen
    )
    reading: bpy.props.PointerProperty(
        name="How It Is Read", description="How the capture is to be read", type=ScanRelightReading
    )
    result_folder: folder_property(
        "Result",
        "Folder for the recovered scene and the finished stages; empty takes one beside the saved .blend, "
        "or in the preferences' results folder",
    )
    preset: preset_property("What all settings start from", update=preset_chosen)
    settings: bpy.props.PointerProperty(
        name="Settings", description="All settings of a recovery", type=ScanRelightSettings
    )
    images: IMAGES
    copies: COPIES
