"""What all operators of the artist's side share: when they can run, and errors that become one sentence."""

from __future__ import annotations

import bpy

from ...addon.bridge.marks import OBJECT_ID
from ..base import poll
from ..base.at_once import AtOnce


class RelightOperator(AtOnce):
    """Works in the scene at once, in one undo step; `work` returns warnings."""

    bl_options = {"REGISTER", "UNDO"}
    needs_room = True

    @classmethod
    def poll(cls, context):
        """Whether the operator can run now; where not, one sentence says what is missing."""
        return (
            poll.has_scene(cls, context)
            and poll.object_mode(cls, context)
            and poll.check(
                cls,
                not cls.needs_room or has_room(context.scene),
                "The scene holds no scanned room yet; recover a capture or open a result's scene.blend.",
            )
        )


def has_room(scene: bpy.types.Scene) -> bool:
    """Whether any object of a scene was scanned."""
    return any(OBJECT_ID in thing for thing in scene.objects)


def default_folder(scene: bpy.types.Scene) -> str:
    """Where pictures and exports go unless told: the result folder, else beside the file, else nowhere ('')."""
    return bpy.path.abspath(scene.scan_relight.result_folder or "//")
