"""`bpy.ops.scan_relight.mark_assets`: the recovered materials into the Asset Browser, or out of it again."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.export import assets
from ...addon.bridge.results import look
from ..base import poll


class SCAN_RELIGHT_OT_mark_assets(bpy.types.Operator):
    """Mark the recovered materials as assets."""

    bl_idname = "scan_relight.mark_assets"
    bl_label = "Mark Materials as Assets"
    bl_description = (
        "Put the recovered materials into the Asset Browser, with tags and previews, or take them out again"
    )
    bl_options = {"REGISTER", "UNDO"}

    selected_only: bpy.props.BoolProperty(
        name="Selected Only", description="Only what the selected objects wear", default=False
    )
    clear: bpy.props.BoolProperty(
        name="Take Out", description="They are no assets any more", default=False, options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        """Whether anything recovered is there."""
        return poll.has_scene(cls, context) and poll.check(
            cls,
            bool(look.recovered(context.scene)),
            "No object of this scene wears recovered materials; run the recovery first.",
        )

    def execute(self, context):
        """Mark or clear, and say how many."""
        things = look.recovered(context.scene)
        if self.selected_only:
            things = [thing for thing in things if thing.select_get()]
        count = assets.clear(things) if self.clear else assets.mark(things, not bpy.app.background)
        if not count:
            self.report(
                {"WARNING"},
                "None of these materials is an asset." if self.clear else "No recovered object is selected.",
            )
            return {"CANCELLED"}
        done = "no assets any more" if self.clear else "in the Asset Browser, Current File"
        self.report({"INFO"}, f"{count} material{'s' * (count > 1)} {done}.")
        return {"FINISHED"}
