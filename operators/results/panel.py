"""The tab's third part: what was found of each object, how sure it is, and the stages that led there."""

from contextlib import suppress
from pathlib import Path

import bpy

from ...addon.bridge.results import file
from ...addon.console import duration
from ...addon.core.brdf.registry import find, models
from ...addon.core.errors import BadInputError
from ...addon.core.kinds import Shown
from ...addon.core.naming import in_order
from ...addon.core.stages import LABELS, RUN_STAGES
from .. import preferences
from ..base.panel import NamedRows, SidebarPanel, places
from . import told as results
from .look import select

NAME: Shown[float] = 0.62
"""Share of a row that the name has where there are figures beside it."""
SIGNS = {"sure": "CHECKMARK", "fair": "DOT", "unsure": "QUESTION", "unknown": "BLANK1"}
MODELS = [
    ("ALL", "All models", "Show every object"),
    *((one.name, one.label, f"Only these: {one.text[0].lower()}{one.text[1:]}") for one in models()),
]
ORDERS = [
    ("NAME", "Name", "By name"),
    ("MODEL", "Model", "By model, then by name"),
    ("CERTAINTY", "Least sure first", "By how sure the material is, the least sure first"),
]


class SCAN_RELIGHT_UL_results(NamedRows, bpy.types.UIList):
    """The recovered objects; the rows are the scene's own objects, so nothing of this is saved."""

    known: dict = {}  # by name; what the last `filter_items` found, as it comes before the rows
    model: bpy.props.EnumProperty(name="Model", description="Which objects are listed", items=MODELS)
    order: bpy.props.EnumProperty(name="Order", description="How the list is sorted", items=ORDERS)

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0, flt_flag=0):
        one = self.known.get(item.name, {})
        text = "  ".join(filter(None, columns(one)))
        split = layout.split(factor=NAME if text else 0.9)  # long names may use what stays empty
        self.name(split, item.name, getattr(find(one.get("model")), "icon", "BLANK1"))
        row = split.row()
        if text:
            row.label(text=text, translate=False)  # one label: the margins of two would leave no room for figures
        row.label(text="", icon=SIGNS[results.certainty(one)])

    def draw_filter(self, context, layout):
        layout.prop(self, "filter_name", text="", icon="VIEWZOOM")
        row = layout.row(align=True)
        row.prop(self, "model", text="")
        row.prop(self, "order", text="")

    def filter_items(self, context, data, property):
        """Only recovered objects that pass the filters, in the chosen order."""
        things = getattr(data, property)
        known = type(self).known = {thing.name: one for thing, one in file.rows(things).items()}
        shown, keys = [], []
        for thing in things:
            one = known.get(thing.name)
            passes = one is not None and self.model in ("ALL", one.get("model"))
            passes = passes and self.filter_name.lower() in thing.name.lower()
            shown.append(self.bitflag_filter_item if passes else 0)
            keys.append(order_key(thing.name, one or {}, self.order))
        return shown, places(keys)


def order_key(name: str, one: dict, order: str) -> tuple:
    """What a row is sorted by."""
    if order == "MODEL":
        return one.get("model", ""), in_order(name)
    if order == "CERTAINTY":
        value = results.interval_width(one)
        return -(value if value is not None else -1.0), in_order(name)
    return in_order(name)


def columns(one: dict) -> tuple[str, str]:
    """Roughness and specular F0 of a row, as short as can be; empty where it has no highlight."""
    if one.get("alpha") is None:
        return "", ""
    value = results.specular(one)
    return _short(max(one["alpha"], 0) ** 0.5), "" if value is None else _short(value)


def _short(value: float) -> str:
    return f"{value:.2f}".removeprefix("0")


def active_row(scene) -> int:
    """The active object's row."""
    thing = bpy.context.view_layer.objects.active if bpy.context.scene == scene else None
    return scene.objects.find(thing.name) if thing is not None else -1


def choose_row(scene, row: int) -> None:
    """A click on a row selects its object."""
    if 0 <= row < len(scene.objects) and bpy.context.scene == scene and bpy.context.mode == "OBJECT":
        with suppress(BadInputError):  # one that is hidden is not selected
            select(bpy.context, scene.objects[row])


def active_row_property():
    """`Scene.scan_relight_row`: follows the active object and is kept nowhere."""
    return bpy.props.IntProperty(
        name="Object",
        description="Click to select the object in the scene",
        get=active_row,
        set=choose_row,
        options={"SKIP_SAVE"},
    )


class SCAN_RELIGHT_PT_results(SidebarPanel, bpy.types.Panel):
    """What was found."""

    bl_label = "Results"
    manual = "panel#results"
    bl_order = 2

    def draw(self, context):
        layout, scene = self.layout, context.scene
        rows, refused = file.rows(scene.objects), results.refused(scene.objects)
        for sentence, folder in refused:
            self.say(layout, sentence, "ERROR")
            self.bring_in(layout, scene, folder)
        found = results.result_of(scene)
        if not rows and not refused and (found is None or not found.objects):
            self.say(
                layout,
                "No result yet: run the recovery to its end, or choose the folder of one that is finished.",
                "INFO",
            )
            return
        if rows:
            head = layout.split(factor=NAME)
            head.label(text="Object")
            head.label(text="Rough  F0")
            layout.template_list("SCAN_RELIGHT_UL_results", "", scene, "objects", scene, "scan_relight_row", rows=6)
        elif not refused:
            self.say(
                layout,
                f"{len(found.objects)} objects in '{found.folder.name}'; none of them is in "
                "this scene. Import the capture to see them.",
                "INFO",
            )
        thing = results.active(scene)
        one = rows.get(thing)
        if one is not None:
            self.details(layout.box(), context, thing.name, one)
        layout.operator("scan_relight.open_report", icon="URL")

    def bring_in(self, layout, scene, folder: Path | None) -> None:
        """The button that renews objects of an earlier run from a folder: the panel's own capture's, or by itself."""
        chosen = preferences.chosen_result(scene)
        if chosen is not None and folder in (None, chosen):
            layout.operator("scan_relight.run", text="Bring In", icon="IMPORT").target = "write"
        elif folder is not None:
            layout.operator("scan_relight.open_result", text="Bring In", icon="IMPORT").folder = str(folder)

    def details(self, layout, context, name: str, one: dict) -> None:
        column = layout.column(align=True)
        column.label(text=name, icon=getattr(find(one.get("model")), "icon", "BLANK1"), translate=False)
        for label, text in results.facts(one):
            split = column.split(factor=0.38)
            split.label(text=label)
            split.label(text=text)
        if one.get("note"):
            self.say(layout, f"{one['note'][0].upper()}{one['note'][1:]}.".replace("..", "."))


class SCAN_RELIGHT_PT_stages(SidebarPanel, bpy.types.Panel):
    """The stages of the run."""

    bl_parent_id = "SCAN_RELIGHT_PT_results"
    bl_label = "Stages"
    bl_order = 1  # below Correct
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        found = results.result_of(context.scene) if context.scene else None
        return found is not None and bool(found.stages)

    def draw(self, context):
        stages = results.result_of(context.scene).stages
        self.say(self.layout, "Run again from a stage on; those before it are taken as they are stored.")
        column = self.layout.column(align=True)
        for name in RUN_STAGES:
            told = stages.get(name)
            row = column.row(align=True)
            split = row.split(factor=0.522)
            split.label(text=LABELS[name])
            seconds = (told or {}).get("seconds")
            split.label(text="" if seconds is None else "stored" if told.get("stored") else duration(seconds))
            again = row.operator("scan_relight.run", text="", icon="FILE_REFRESH")
            again.target, again.from_stage = "recover", name
