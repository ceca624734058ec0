"""`bpy.ops.scan_relight.link_room`: the recovered room into another scene of the file."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.scene.parts import rooms
from ...addon.core.errors import BadInputError
from ..base import poll
from ..base.at_once import AtOnce

_items: list[tuple[str, str, str]] = []  # Blender keeps no reference of its own


def others(operator, context) -> list[tuple[str, str, str]]:
    """The scenes that a room of this one can go to."""
    _items[:] = [
        (scene.name, scene.name, "Show the room in this scene as well")
        for scene in bpy.data.scenes
        if context.scene is not None and scene != context.scene and not scene.library
    ]
    return _items


@poll.needs(lambda context: len(bpy.data.scenes) > 1, "This file has no other scene to link the room into.")
@poll.needs(lambda context: rooms(context.scene), "The scene holds no scanned room; run the recovery first.")
@poll.has_scene
class SCAN_RELIGHT_OT_link_room(AtOnce, bpy.types.Operator):
    """Show the recovered room in another scene of this file as well: one room in two scenes, so that what is changed in
    one is changed in the other"""

    bl_idname = "scan_relight.link_room"
    bl_label = "Link into Scene"
    remarks = "INFO"

    scene: bpy.props.EnumProperty(name="Scene", description="Where the room is linked", items=others)
    outside: bpy.props.BoolProperty(
        name="With Its Outside", description="Give that scene the room's world and exposure, too"
    )

    def work(self, context):
        from ...addon.bridge.room.bring import link_room

        target = bpy.data.scenes.get(self.scene)
        if target is None:
            raise BadInputError("Choose the scene to link the room into.")
        for top in rooms(context.scene):
            link_room(top, target, context.scene if self.outside else None)
        return [f"The room is in scene '{target.name}' as well."]
