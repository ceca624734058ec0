"""The artist's own set-ups of light, kept by Blender's presets in `presets/scan_relight/light`."""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase

from ..base import poll
from .base import has_room

FOLDER = "scan_relight/light"


class SCAN_RELIGHT_MT_light_presets(bpy.types.Menu):
    """The set-ups that were saved."""

    bl_label = "My Lights"
    bl_description = "Light this room as another one was lit"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


@poll.needs(lambda context: has_room(context.scene), "The scene holds no scanned room to light.")
@poll.has_scene
class SCAN_RELIGHT_OT_light_preset_add(AddPresetBase, bpy.types.Operator):
    """Save the lights that were added, the lamps' factors and the outside under a name, to light other rooms the same
    way"""

    bl_idname = "scan_relight.light_preset_add"
    bl_label = "Save This Light"
    preset_menu = "SCAN_RELIGHT_MT_light_presets"
    preset_subdir = FOLDER
    preset_defines = ["studio = bpy.context.scene.scan_relight_studio"]
    preset_values = ["studio.setup"]
