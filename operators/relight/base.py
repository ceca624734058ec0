"""What all operators of the artist's side share: when they can run, and errors that become one sentence."""

from __future__ import annotations

import bpy

from ...addon.bridge.marks import OBJECT_ID
from ..base import poll
from ..base.at_once import AtOnce


@poll.object_mode
@poll.has_scene
class SceneOperator(AtOnce):
    """Works in the scene at once, in one undo step; `work` returns warnings."""


@poll.needs(
    lambda context: has_room(context.scene),
    "The scene holds no scanned room yet; recover a capture or open a result's scene.blend.",
)
class RelightOperator(SceneOperator):
    """The same in a scanned room."""


def has_room(scene: bpy.types.Scene) -> bool:
    """Whether any object of a scene was scanned."""
    return any(OBJECT_ID in thing for thing in scene.objects)


def default_folder(scene: bpy.types.Scene) -> str:
    """Where pictures and exports go unless told: the result folder, else beside the file, else nowhere ('')."""
    return bpy.path.abspath(scene.scan_relight.result_folder or "//")
