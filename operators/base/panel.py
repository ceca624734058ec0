"""What all panels of the sidebar's tab "Scan Relight" share."""

from __future__ import annotations

from ...addon.core.naming import numbered
from .. import translations
from . import text


class SidebarPanel:
    """A part of the tab. `bl_order`: Capture 0, Recover 1, Results 2, Look 3, Relight 4, Export 5."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Scan Relight"
    bl_translation_context = translations.OWN
    manual = ""
    """Page of the documentation that "?" in the header opens; '' has none."""

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def draw_header_preset(self, context):
        """The way to the documentation."""
        if self.manual:
            self.layout.operator("scan_relight.manual", text="", icon="HELP", emboss=False).page = self.manual

    @staticmethod
    def say(layout, context, sentence: str, icon: str = "NONE") -> None:
        """Write `sentence` over as many lines as the panel's width asks for."""
        text.say(layout, context, sentence, icon)


class NamedRows:
    """A list whose rows are named after objects of the room."""

    @staticmethod
    def name(layout, name: str, icon: str = "NONE") -> None:
        """Write a name; its number has a column of its own, so that a narrow panel cuts the class and never that."""
        kind, number = numbered(name)
        row = layout.row()
        row.label(text=kind, icon=icon, translate=False)
        if number:
            last = row.row()
            last.alignment = "RIGHT"
            last.ui_units_x = 0.5 + 0.45 * len(number)
            last.label(text=number, translate=False)


def places(keys: list) -> list[int]:
    """Where each of `keys` stands when they are sorted, as `UIList.filter_items` returns it."""
    found = [0] * len(keys)
    for place, number in enumerate(sorted(range(len(keys)), key=keys.__getitem__)):
        found[number] = place
    return found
