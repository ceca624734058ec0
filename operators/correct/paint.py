"""`bpy.ops.scan_relight.*` for what no frame saw: paint it, fill it, and back to what was found."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.corrections import painting, unseen
from ...addon.core.errors import BadInputError
from ..base import poll
from .base import CorrectOperator, chosen, on_selected


@on_selected
class SCAN_RELIGHT_OT_paint_unseen(CorrectOperator, bpy.types.Operator):
    """Paint what no frame saw of the active object in Texture Paint, on an image of your own that no run writes over;
    what was seen is masked"""

    bl_idname = "scan_relight.paint_unseen"
    bl_label = "Paint"

    masked: bpy.props.BoolProperty(
        name="Only Unseen Spots", description="Protect what any frame saw by a stencil mask", default=True
    )

    def work(self, context, things):
        thing = context.view_layer.objects.active
        if thing not in things:
            raise BadInputError("Make the object that is to be painted the active one: click on it.")
        painting.begin(context, thing, context.scene.scan_relight.images, self.masked)
        return [f"Painting '{unseen.painted(thing).name}'; leave Texture Paint for object mode when done"]


@on_selected
class SCAN_RELIGHT_OT_fill_unseen(CorrectOperator, bpy.types.Operator):
    """Fill what no frame saw of the selected objects from the measured spots around, on an image of your own that no
    run writes over"""

    bl_idname = "scan_relight.fill_unseen"
    bl_label = "Fill"

    def work(self, context, things):
        count, remarks = unseen.fill(things, context.scene.scan_relight.images)
        if not count:
            raise BadInputError(" ".join(remarks))
        return [f"{count} texels filled", *remarks]


@poll.needs(
    lambda context: any(map(unseen.painted, chosen(context))), "Nothing was painted or filled on the selected objects."
)
@on_selected
class SCAN_RELIGHT_OT_restore_painted(CorrectOperator, bpy.types.Operator):
    """Show what was found instead of what was painted or filled on the selected objects"""

    bl_idname = "scan_relight.restore_painted"
    bl_label = "Restore"

    discard: bpy.props.BoolProperty(
        name="Forget What Was Painted",
        description="Take it out of your image too; else Paint shows it again",
        default=False,
    )

    def work(self, context, things):
        count = unseen.restore(things, self.discard)
        return [f"{count} object{'s' * (count != 1)} restored"]


@bpy.app.handlers.persistent
def keep_painted(*_) -> None:
    """Before the file is saved: what was painted goes with it."""
    unseen.keep_painted()
