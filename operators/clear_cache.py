"""`bpy.ops.scan_relight.clear_cache`: free what runs have left in the cache folder of the preferences."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import bpy

from . import poll, preferences


class SCAN_RELIGHT_OT_clear_cache(bpy.types.Operator):
    """Clear the cache folder."""

    bl_idname = "scan_relight.clear_cache"
    bl_label = "Clear Cache"
    bl_description = "Delete what runs have left in the cache folder; nothing else in it is touched"

    what: bpy.props.EnumProperty(name="Delete", description="What is deleted", default="STAGES", items=[
        ("STAGES", "Finished stages", "Results stay as they are; a further run begins anew"),
        ("ALL", "Whole results", "Also images: scenes that show them lose their textures. A result whose scene.blend "
         "you have saved again is kept")])

    @classmethod
    def poll(cls, context):
        """Not while a run may be writing there."""
        return poll.no_run(cls)

    def invoke(self, context, event):
        """Ask first."""
        return context.window_manager.invoke_props_dialog(self, confirm_text="Delete")

    def draw(self, context):
        """What, and where."""
        layout = self.layout
        layout.label(text=str(preferences.cache_folder()), icon="FILE_CACHE")
        layout.prop(self, "what", expand=True)

    def execute(self, context):
        """Delete, and say how much is free again."""
        from ..addon.core.result_cache import clear

        done = clear(preferences.cache_folder(), whole=self.what == "ALL")
        preferences.forget_size()
        for sentence in done.left:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{preferences.amount(done.freed)} of {done.results} results deleted.")
        return {"FINISHED"}
