"""The window goes to a room's own scene, and the panel's choices go with it."""

from __future__ import annotations

import bpy

from ...addon.bridge.scene import settings
from ...addon.bridge.scene.parts import find_room, own_scene


def show(before: bpy.types.Scene, scene: bpy.types.Scene) -> None:
    """Show a room's own scene in the window; its panel has what was chosen in the scene `before`."""
    if scene != before:
        take(scene.scan_relight, before.scan_relight)
    settings.show(bpy.context.window, scene)


def show_own(before: bpy.types.Scene, capture_folder: str) -> None:
    """`show` the own scene of a capture's room, if it has one."""
    top = find_room(capture_folder)
    scene = own_scene(top) if top is not None else None
    if scene is not None:
        show(before, scene)


def take(choices, before) -> None:
    """Copy all that was chosen from one group of properties to another of its kind."""
    for name, info in before.bl_rna.properties.items():
        if name in ("rna_type", "name"):
            continue
        if info.type == "POINTER":
            take(getattr(choices, name), getattr(before, name))
        elif not info.is_readonly and getattr(choices, name) != getattr(before, name):
            setattr(choices, name, getattr(before, name))
