"""Within Results: the artist's corrections of the active object, and of elements that no frame saw."""

import bpy

from ...addon.bridge.corrections import corrections, unseen
from ...addon.bridge.data.instances import name_of
from ...addon.core.brdf.registry import find_or_lambertian, named
from ...addon.core.photo import MIDDLE_GREY
from ..base.job_operator import active, bar
from ..base.panel import SidebarPanel, fields
from .correct import chosen
from .props import STATEMENTS


def the_object(context) -> bpy.types.Object | None:
    """The active recovered object, or None."""
    obj = getattr(context, "active_object", None)
    return obj if corrections.correctable(obj) else None


class SCAN_RELIGHT_PT_correct(SidebarPanel, bpy.types.Panel):
    """Correct the active object."""

    bl_parent_id = "SCAN_RELIGHT_PT_results"
    manual = "corrections"
    bl_label = "Correct"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and the_object(context) is not None

    def draw(self, context):
        layout, obj = self.layout, the_object(context)
        choices, objects = context.scene.scan_relight_correct, chosen(context)
        others = len([other for other in objects if other != obj])
        name = name_of(obj)
        layout.label(text=f"{name} and {others} more" if others else name, icon="OBJECT_DATA", translate=False)
        self.statements(layout, choices, obj)
        self.values(layout, obj)
        if others:
            layout.prop(choices, "all_selected")
        self.refit(layout, choices, obj)

    def statements(self, layout, choices, obj) -> None:
        column = layout.column(align=True)
        column.label(text="This is:")
        given = corrections.given(obj)
        for statements in (STATEMENTS[start : start + 2] for start in range(0, len(STATEMENTS), 2)):
            row = column.row(align=True)
            for model, label, _ in statements:
                row.operator(
                    "scan_relight.this_is", text=label, icon=named(model).icon, depress=given.get("model") == model
                ).model = model
        row = column.row(align=True)
        row.prop(choices, "like", text="", icon="OBJECT_DATA")
        row.operator("scan_relight.same_as", text="The Same As")
        if given.get("same_as") is not None:
            like = given["same_as"]
            other = corrections.by_id(obj, like)
            row = layout.row(align=True)
            row.label(text=f"The same as {name_of(other, like) if other else like}", icon="PINNED", translate=False)
            row.operator("scan_relight.take_back", text="", icon="LOOP_BACK").key = "same_as"

    def values(self, layout, obj) -> None:
        """Each value with a pin where it is given, and a button to reset it."""
        given, brdf = corrections.given(obj), find_or_lambertian(corrections.effective(obj)["model"])
        values, metal = obj.scan_relight_correct, brdf.lobe_alone
        rows = [("model", "model")]
        if brdf.has_lobe:
            rows += [("roughness", "roughness")]
            rows += [("f0", "colour")] if metal else [("f0", "f0")]
        if brdf.has_diffuse:
            rows += [("base_color", "colour")]
        column = fields(layout.column(align=True))
        for key, name in rows:
            pinned = key in given or (metal and name == "colour" and "base_color" in given)
            row = column.row(align=True)
            row.prop(
                values,
                name,
                icon="PINNED" if pinned else "NONE",
                **({"text": "F0 Color"} if metal and name == "colour" else {}),
            )
            reset = row.row(align=True)
            reset.enabled = pinned
            key = "base_color" if pinned and key not in given else key
            reset.operator("scan_relight.take_back", text="", icon="LOOP_BACK" if pinned else "BLANK1").key = key

    def refit(self, layout, choices, obj) -> None:
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
        if job is None and corrections.given(obj) != (corrections.entry(obj).get("given") or {}):
            self.say(layout, "Shown as given; Refit fits the rest of it to that.", "INFO")


class CorrectPart(SidebarPanel):
    """A sub-panel of it, closed by default."""

    bl_parent_id = "SCAN_RELIGHT_PT_correct"
    bl_options = {"DEFAULT_CLOSED"}


class SCAN_RELIGHT_PT_correct_scale(CorrectPart, bpy.types.Panel):
    """An object or spot of known albedo."""

    bl_label = "Known White"

    def draw(self, context):
        layout, choices, obj = self.layout, context.scene.scan_relight_correct, the_object(context)
        self.say(layout, "An albedo that is known scales that of the whole room.")
        layout.prop(choices, "albedo")
        row = layout.row(align=True)
        row.operator("scan_relight.this_is_white", text="This Object").albedo = choices.albedo
        row.operator("scan_relight.pick_white", text="Spot", icon="EYEDROPPER").albedo = choices.albedo
        layout.operator("scan_relight.pick_white", text="Grey Card (0.18)", icon="EYEDROPPER").albedo = (
            MIDDLE_GREY,
        ) * 3
        white = corrections.white_of(obj) if obj is not None else None
        if white is not None:
            row = layout.row(align=True)
            row.label(
                text=f"{name_of(*white[:2])}: {', '.join(f'{channel:.2f}' for channel in white[2])}",
                icon="PINNED",
                translate=False,
            )
            row.operator("scan_relight.white_back", text="", icon="LOOP_BACK")


class SCAN_RELIGHT_PT_correct_unseen(CorrectPart, bpy.types.Panel):
    """Elements that no frame saw."""

    bl_label = "Unseen Spots"

    def draw(self, context):
        layout, obj = self.layout, the_object(context)
        row = layout.row(align=True)
        row.operator("scan_relight.paint_unseen", icon="BRUSH_DATA")
        row.operator("scan_relight.fill_unseen", icon="IMAGE_DATA")
        image = unseen.painted(obj) if obj is not None else None
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
        for text, everything, target_angle in (
            ("Selected", False, angle),
            ("Whole Room", True, angle),
            ("Flat", False, 0.0),
        ):
            button = row.operator("scan_relight.smooth_by_angle", text=text)
            button.everything, button.angle = everything, target_angle
