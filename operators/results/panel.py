"""The tab's third part: findings on each object, their certainty, and the stages of the run."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import bpy

from ...addon.bridge.data.instances import chosen_in, in_slot, name_of
from ...addon.bridge.results import file
from ...addon.console import duration
from ...addon.core.brdf.registry import find, models
from ...addon.core.errors import BadInputError
from ...addon.core.kinds import Shown
from ...addon.core.naming import in_order
from ...addon.core.stages import LABELS, RUN_STAGES
from .. import preferences
from ..base.panel import SidebarPanel, draw_name, places
from ..base.properties import enum_property, int_property
from . import summary as results
from .look import select

NAME: Shown[float] = 0.62
"""Share of the name in a row with numbers beside it."""
SIGNS = {"sure": "CHECKMARK", "fair": "DOT", "unsure": "QUESTION", "unknown": "BLANK1"}
MODELS = [
    ("ALL", "All models", "Show every object"),
    *((brdf.name, brdf.label, f"Only these: {brdf.text[0].lower()}{brdf.text[1:]}") for brdf in models()),
]
ORDERS = [
    ("NAME", "Name", "By name"),
    ("MODEL", "Model", "By model, then by name"),
    ("CERTAINTY", "Least sure first", "By how sure the material is, the least sure first"),
]


def draw_row(layout, name: str, entry: dict) -> None:
    """Draw what was found of an object: name, roughness, F0 and certainty."""
    text = "  ".join(filter(None, columns(entry)))
    split = layout.split(factor=NAME if text else 0.9)  # long names may use the empty space
    draw_name(split, name, getattr(find(entry.get("model")), "icon", "BLANK1"))
    row = split.row()
    if text:
        row.label(text=text, translate=False)  # one label: the margins of two would leave no space for numbers
    row.label(text="", icon=SIGNS[results.certainty(entry)])


class SCAN_RELIGHT_UL_results(bpy.types.UIList):
    """The recovered objects; the rows are the scene's own objects, so none of this is saved.

    An object with parts is listed by the least sure of those that pass the filter.
    """

    entries: dict = {}  # by name; result of the last `filter_items`, which runs before the rows are drawn
    model: enum_property("Model", "Which objects are listed", MODELS)
    order: enum_property("Order", "How the list is sorted", ORDERS)

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0, flt_flag=0):
        draw_row(layout, item.name, self.entries.get(item.name, {}))

    def draw_filter(self, context, layout):
        layout.prop(self, "filter_name", text="", icon="VIEWZOOM")
        row = layout.row(align=True)
        row.prop(self, "model", text="")
        row.prop(self, "order", text="")

    def filter_items(self, context, data, property):
        """Only recovered objects that pass the filters, in the chosen order."""
        objects = getattr(data, property)
        entries = type(self).entries = {
            obj.name: entry
            for obj, parts in file.rows_of_parts(objects).items()
            if (entry := least_sure(parts.values(), self.model)) is not None
        }
        flags, keys = [], []
        for obj in objects:
            entry = entries.get(obj.name)
            listed = entry is not None and self.filter_name.lower() in obj.name.lower()
            flags.append(self.bitflag_filter_item if listed else 0)
            keys.append(order_key(obj.name, entry or {}, self.order))
        return flags, places(keys)


class SCAN_RELIGHT_UL_parts(bpy.types.UIList):
    """The material slots of an object with parts, as Blender lists them; an empty row shows nothing recovered."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0, flt_flag=0):
        entry = file.rows_of_parts([data]).get(data, {}).get(in_slot(data, index), {})
        draw_row(layout, item.material.name if item.material else "", entry)


def least_sure(parts: Iterable[dict], model: str = "ALL") -> dict | None:
    """The entry of the least sure part of those of a model; None without any."""
    fitting = [entry for entry in parts if model in ("ALL", entry.get("model"))]
    return max(fitting, key=lambda entry: results.interval_width(entry) or 0.0, default=None)


def order_key(name: str, entry: dict, order: str) -> tuple:
    """Sort key of a row."""
    if order == "MODEL":
        return entry.get("model", ""), in_order(name)
    if order == "CERTAINTY":
        value = results.interval_width(entry)
        return -(value if value is not None else -1.0), in_order(name)
    return in_order(name)


def columns(entry: dict) -> tuple[str, str]:
    """Roughness and specular F0 of a row, as short as possible; empty where it has no specular lobe."""
    if entry.get("alpha") is None:
        return "", ""
    value = results.specular(entry)
    return _short(max(entry["alpha"], 0) ** 0.5), "" if value is None else _short(value)


def _short(value: float) -> str:
    return f"{value:.2f}".removeprefix("0")


def active_row(scene) -> int:
    """The active object's row."""
    obj = results.active(scene)
    return scene.objects.find(obj.name) if obj is not None else -1


def choose_row(scene, row: int) -> None:
    """A click on a row selects its object."""
    if 0 <= row < len(scene.objects) and bpy.context.scene == scene and bpy.context.mode == "OBJECT":
        with suppress(BadInputError):  # hidden objects are not selected
            select(bpy.context, scene.objects[row])


def active_row_property():
    """`Scene.scan_relight_row`: follows the active object and is not stored."""
    return int_property(
        "Object", "Click to select the object in the scene", get=active_row, set=choose_row, options={"SKIP_SAVE"}
    )


class SCAN_RELIGHT_PT_results(SidebarPanel, bpy.types.Panel):
    """The recovered objects."""

    bl_label = "Results"
    manual = "panel#results"
    bl_order = 2

    def draw(self, context):
        layout, scene = self.layout, context.scene
        rows, refused = file.rows_of_parts(scene.objects), results.refused(scene.objects)
        for sentence, folder in refused:
            self.say(layout, sentence, "ERROR")
            self.bring_in(layout, scene, folder)
        result = results.result_of(scene)
        if not rows and not refused and (result is None or not result.objects):
            self.say(
                layout,
                "No result yet: run the recovery to its end, or choose the folder of one that is finished.",
                "INFO",
            )
            return
        if rows:
            header = layout.split(factor=NAME)
            header.label(text="Object")
            header.label(text="Rough  F0")
            layout.template_list("SCAN_RELIGHT_UL_results", "", scene, "objects", scene, "scan_relight_row", rows=6)
        elif not refused:
            self.say(
                layout,
                f"{len(result.objects)} objects in '{result.folder.name}'; none of them is in "
                "this scene. Import the capture to see them.",
                "INFO",
            )
        obj = results.active(scene)
        parts = rows.get(obj, {})
        if len(parts) > 1:
            layout.label(text="Parts")
            layout.template_list(
                "SCAN_RELIGHT_UL_parts", "", obj, "material_slots", obj, "active_material_index", rows=len(parts)
            )
        if parts and (entry := parts.get(chosen_in(obj))) is not None:
            self.details(layout.box(), name_of(obj), entry)
        layout.operator("scan_relight.open_report", icon="URL")

    def bring_in(self, layout, scene, folder: Path | None) -> None:
        """The button that updates objects of an earlier run from a folder: by the panel's capture, or alone."""
        chosen = preferences.chosen_result(scene)
        if chosen is not None and folder in (None, chosen):
            layout.operator("scan_relight.run", text="Bring In", icon="IMPORT").target = "write"
        elif folder is not None:
            layout.operator("scan_relight.open_result", text="Bring In", icon="IMPORT").folder = str(folder)

    def details(self, layout, name: str, entry: dict) -> None:
        column = layout.column(align=True)
        column.label(text=name, icon=getattr(find(entry.get("model")), "icon", "BLANK1"), translate=False)
        for label, text in results.facts(entry):
            split = column.split(factor=0.38)
            split.label(text=label)
            split.label(text=text)
        if entry.get("note"):
            self.say(layout, f"{entry['note'][0].upper()}{entry['note'][1:]}.".replace("..", "."))


class SCAN_RELIGHT_PT_stages(SidebarPanel, bpy.types.Panel):
    """The stages of the run."""

    bl_parent_id = "SCAN_RELIGHT_PT_results"
    bl_label = "Stages"
    bl_order = 1  # below Correct
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        result = results.result_of(context.scene) if context.scene else None
        return result is not None and bool(result.stages)

    def draw(self, context):
        stages = results.result_of(context.scene).stages
        self.say(self.layout, "Run again from a stage on; those before it are taken as they are stored.")
        column = self.layout.column(align=True)
        for name in RUN_STAGES:
            stage = stages.get(name)
            row = column.row(align=True)
            split = row.split(factor=0.522)
            split.label(text=LABELS[name])
            seconds = (stage or {}).get("seconds")
            split.label(text="" if seconds is None else "stored" if stage.get("stored") else duration(seconds))
            button = row.operator("scan_relight.run", text="", icon="FILE_REFRESH")
            button.target, button.from_stage = "recover", name
