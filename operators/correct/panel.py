"""Within Results: what the artist knows better of the active object, and of spots that no frame saw."""

import bpy

from ...addon.bridge.corrections import corrections, unseen
from ...addon.core.brdf.registry import named, shown
from ...addon.core.photo import MIDDLE_GREY
from ..base.job_operator import active, bar
from ..base.panel import SidebarPanel, fields
from .correct import chosen
from .props import STATEMENTS


def the_object(context) -> bpy.types.Object | None:
    """The active recovered object, or None."""
    thing = getattr(context, "active_object", None)
    return thing if corrections.correctable(thing) else None


class SCAN_RELIGHT_PT_correct(SidebarPanel, bpy.types.Panel):
    """Correct the active object."""

    bl_parent_id = "SCAN_RELIGHT_PT_results"
    manual = "corrections"
    bl_label = "Correct"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and the_object(context) is not None

    def draw(self, context):
        layout, thing = self.layout, the_object(context)
        choices, things = context.scene.scan_relight_correct, chosen(context)
        others = len([one for one in things if one != thing])
        layout.label(
            text=f"{thing.name} and {others} more" if others else thing.name, icon="OBJECT_DATA", translate=False
        )
        self.statements(layout, context, choices, thing)
        self.values(layout, thing)
        if others:
            layout.prop(choices, "all_selected")
        self.refit(layout, context, choices, thing)

    def statements(self, layout, context, choices, thing) -> None:
        column = layout.column(align=True)
        column.label(text="This is:")
        said = corrections.given(thing)
        for pair in (STATEMENTS[at : at + 2] for at in range(0, len(STATEMENTS), 2)):
            row = column.row(align=True)
            for model, label, _ in pair:
                row.operator(
                    "scan_relight.this_is", text=label, icon=named(model).icon, depress=said.get("model") == model
                ).model = model
        row = column.row(align=True)
        row.prop(choices, "like", text="", icon="OBJECT_DATA")
        row.operator("scan_relight.same_as", text="The Same As")
        if said.get("same_as") is not None:
            other = corrections.by_id(thing, said["same_as"])
            row = layout.row(align=True)
            row.label(text=f"The same as {other.name if other else said['same_as']}", icon="PINNED", translate=False)
            row.operator("scan_relight.take_back", text="", icon="LOOP_BACK").key = "same_as"

    def values(self, layout, thing) -> None:
        """Each value with a pin where it is given, and the way back."""
        said, brdf = corrections.given(thing), shown(corrections.effective(thing)["model"])
        values, metal = thing.scan_relight_correct, brdf.lobe_alone
        rows = [("model", "model")]
        if brdf.has_lobe:
            rows += [("roughness", "roughness")]
            rows += [("f0", "colour")] if metal else [("f0", "f0")]
        if brdf.has_diffuse:
            rows += [("base_color", "colour")]
        column = fields(layout.column(align=True))
        for key, name in rows:
            pinned = key in said or (metal and name == "colour" and "base_color" in said)
            row = column.row(align=True)
            row.prop(
                values,
                name,
                icon="PINNED" if pinned else "NONE",
                **({"text": "F0 Color"} if metal and name == "colour" else {}),
            )
            back = row.row(align=True)
            back.enabled = pinned
            key = "base_color" if pinned and key not in said else key
            back.operator("scan_relight.take_back", text="", icon="LOOP_BACK" if pinned else "BLANK1").key = key

    def refit(self, layout, context, choices, thing) -> None:
        job = active()
        if job is not None and "before" in job.facts:
            share, text = bar(job)
            row = layout.row(align=True)
            row.progress(factor=share, text=text)
            row.operator("scan_relight.stop", text="", icon="X")
            return
        row = layout.row(align=True)
        row.operator("scan_relight.refit", icon="FILE_REFRESH")
        row.operator("scan_relight.take_back", text="All Back", icon="LOOP_BACK").key = "all"
        layout.prop(choices, "refit_automatically")
        if job is None and corrections.given(thing) != (corrections.entry(thing).get("given") or {}):
            self.say(layout, "Shown as given; Refit fits the rest of it to that.", "INFO")


class CorrectPart(SidebarPanel):
    """Below it, and folded away at first."""

    bl_parent_id = "SCAN_RELIGHT_PT_correct"
    bl_options = {"DEFAULT_CLOSED"}


class SCAN_RELIGHT_PT_correct_scale(CorrectPart, bpy.types.Panel):
    """A known white."""

    bl_label = "Known White"

    def draw(self, context):
        layout, choices, thing = self.layout, context.scene.scan_relight_correct, the_object(context)
        self.say(layout, "An albedo that is known scales that of the whole room.")
        layout.prop(choices, "albedo")
        row = layout.row(align=True)
        row.operator("scan_relight.this_is_white", text="This Object").albedo = choices.albedo
        row.operator("scan_relight.pick_white", text="Spot", icon="EYEDROPPER").albedo = choices.albedo
        layout.operator("scan_relight.pick_white", text="Grey Card (0.18)", icon="EYEDROPPER").albedo = (
            MIDDLE_GREY,
        ) * 3
        known = corrections.white_of(thing) if thing is not None else None
        if known is not None:
            row = layout.row(align=True)
            row.label(
                text=f"{known[0].name}: {', '.join(f'{part:.2f}' for part in known[1])}", icon="PINNED", translate=False
            )
            row.operator("scan_relight.white_back", text="", icon="LOOP_BACK")


class SCAN_RELIGHT_PT_correct_unseen(CorrectPart, bpy.types.Panel):
    """What no frame saw."""

    bl_label = "Unseen Spots"

    def draw(self, context):
        layout, thing = self.layout, the_object(context)
        row = layout.row(align=True)
        row.operator("scan_relight.paint_unseen", icon="BRUSH_DATA")
        row.operator("scan_relight.fill_unseen", icon="IMAGE_DATA")
        image = unseen.painted(thing) if thing is not None else None
        if image is not None:
            row = layout.row(align=True)
            row.label(text=image.name, icon="PINNED", translate=False)
            row.operator("scan_relight.restore_painted", text="", icon="LOOP_BACK")


class SCAN_RELIGHT_PT_correct_smooth(CorrectPart, bpy.types.Panel):
    """Smooth shading."""

    bl_label = "Smooth Shading"

    def draw(self, context):
        layout, angle = self.layout, context.scene.scan_relight_correct.smooth_angle
        layout.prop(context.scene.scan_relight_correct, "smooth_angle")
        row = layout.row(align=True)
        for text, everything, wanted in (("Selected", False, angle), ("Whole Room", True, angle), ("Flat", False, 0.0)):
            button = row.operator("scan_relight.smooth_by_angle", text=text)
            button.everything, button.angle = everything, wanted
