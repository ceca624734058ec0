"""`bpy.ops.scan_relight.restore_materials`: objects wear again what they wore before the recovered materials."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.results import look
from ..base import poll
from ..base.at_once import AtOnce, NothingDone


def _wearing(context) -> bool:
    from ...addon.bridge.own_scene.write_back import wearing

    return context.scene is not None and bool(wearing(context.scene.objects))


@poll.needs(_wearing, "No object of this scene wears a recovered material over its own.")
@poll.object_mode
class SCAN_RELIGHT_OT_restore_materials(AtOnce, bpy.types.Operator):
    """Give your objects back the materials and UV maps that they had before the recovered ones; copies that were made
    for recovered materials are removed"""

    bl_idname = "scan_relight.restore_materials"
    bl_label = "Restore Materials"

    selected_only: bpy.props.BoolProperty(
        name="Selected Only", description="Leave the objects that are not selected as they are", default=False
    )

    def work(self, context):
        from ...addon.bridge.own_scene.write_back import restore

        count, warnings = restore(list(context.selected_objects if self.selected_only else context.scene.objects))
        look.refresh(context.scene)
        if not count:
            raise NothingDone("None of the selected objects wears a recovered material over its own.")
        self.report({"INFO"}, f"{count} object{'s' * (count > 1)} restored")
        return warnings
