"""`bpy.ops.scan_relight.mark_assets`: the recovered materials into the Asset Browser, or out of it again."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from ...addon.bridge.export import assets
from ...addon.bridge.results import look
from ..base.at_once import AtOnce, NothingDone
from ..results.look import needs_recovered


@needs_recovered
class SCAN_RELIGHT_OT_mark_assets(AtOnce, bpy.types.Operator):
    """Put the recovered materials into the Asset Browser, with tags and previews, or take them out again"""

    bl_idname = "scan_relight.mark_assets"
    bl_label = "Mark Materials as Assets"
    remarks = "INFO"

    selected_only: bpy.props.BoolProperty(
        name="Selected Only", description="Only what the selected objects wear", default=False
    )
    clear: bpy.props.BoolProperty(
        name="Take Out", description="They are no assets any more", default=False, options={"SKIP_SAVE"}
    )

    def work(self, context):
        things = look.recovered(context.scene)
        if self.selected_only:
            things = [thing for thing in things if thing.select_get()]
        count = assets.clear(things) if self.clear else assets.mark(things, not bpy.app.background)
        if not count:
            raise NothingDone(
                "None of these materials is an asset." if self.clear else "No recovered object is selected."
            )
        done = "no assets any more" if self.clear else "in the Asset Browser, Current File"
        return [f"{count} material{'s' * (count > 1)} {done}."]
