"""`bpy.ops.scan_relight.restore_materials`: objects wear again what they wore before the recovered materials."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ..base import poll


class SCAN_RELIGHT_OT_restore_materials(bpy.types.Operator):
    """Give the objects back what they wore before."""

    bl_idname = "scan_relight.restore_materials"
    bl_label = "Restore Materials"
    bl_description = (
        "Give your objects back the materials and UV maps that they had before the recovered ones; "
        "copies that were made for recovered materials are removed"
    )
    bl_options = {"REGISTER", "UNDO"}

    selected_only: bpy.props.BoolProperty(
        name="Selected Only", description="Leave the objects that are not selected as they are", default=False
    )

    @classmethod
    def poll(cls, context):
        """Whether anything wears recovered materials over its own."""
        from ...addon.bridge.own_scene.write_back import wearing

        return poll.object_mode(cls, context) and poll.check(
            cls,
            context.scene is not None and bool(wearing(context.scene.objects)),
            "No object of this scene wears a recovered material over its own.",
        )

    def execute(self, context):
        """Give them back."""
        from ...addon.bridge.own_scene.write_back import restore
        from ...addon.bridge.results import look

        things = list(context.selected_objects if self.selected_only else context.scene.objects)
        count, warnings = restore(things)
        look.refresh(context.scene)
        for sentence in warnings:
            self.report({"WARNING"}, sentence)
        if not count:
            self.report({"WARNING"}, "None of the selected objects wears a recovered material over its own.")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{count} object{'s' * (count > 1)} restored")
        return {"FINISHED"}
