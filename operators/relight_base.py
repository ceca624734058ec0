"""What all operators of the artist's side share: when they can run, and errors that become one sentence."""

from __future__ import annotations

import bpy

from ..addon.bridge.mesh_objects import OBJECT_ID
from ..addon.console import unexpected
from ..addon.core.errors import ScanRelightError


class RelightOperator:
    """Works in the scene at once, in one undo step; `work` returns warnings."""

    bl_options = {"REGISTER", "UNDO"}
    needs_room = True

    @classmethod
    def poll(cls, context):
        """Whether the operator can run now; where not, one sentence says what is missing."""
        if context.scene is None:
            cls.poll_message_set("There is no scene to work in.")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the editing mode for object mode first.")
            return False
        if cls.needs_room and not has_room(context.scene):
            cls.poll_message_set("The scene holds no scanned room yet; recover a capture or open a result's "
                                 "scene.blend.")
            return False
        return True

    def execute(self, context):
        """Do the work; every error that is foreseen becomes one sentence."""
        try:
            for sentence in self.work(context) or ():
                self.report({"WARNING"}, sentence)
        except ScanRelightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except Exception as error:  # the last line of defence: a sentence, never a bare traceback
            self.report({"ERROR"}, unexpected(error, bpy.app.tempdir))
            return {"CANCELLED"}
        return {"FINISHED"}


def has_room(scene: bpy.types.Scene) -> bool:
    """Whether any object of a scene was scanned."""
    return any(OBJECT_ID in thing for thing in scene.objects)


def default_folder(scene: bpy.types.Scene) -> str:
    """Where pictures and exports go unless told: the result folder, else beside the file, else nowhere ('')."""
    chosen = scene.scan_relight.result_folder
    return bpy.path.abspath(chosen) if chosen else bpy.path.abspath("//")
