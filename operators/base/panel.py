"""What all panels of the sidebar's tab "Scan Relight" share; Blender cuts a label off at the panel's edge, so that
sentences are laid over several lines.
"""

from functools import lru_cache

import bpy

from ...addon.core.kinds import Shown
from ...addon.core.naming import numbered
from .. import translations

MARGIN: Shown[int] = 68
"""Pixels at an interface scale of 1 that the tabs, the panel's edges and paddings take."""
ICON: Shown[int] = 20


def say(layout, sentence: str, icon: str = "NONE") -> None:
    """Write `sentence` over as many lines as the region's width asks for; the icon stands before the first."""
    sentence = translations.told(sentence)
    preferences = bpy.context.preferences
    scale = preferences.system.ui_scale or 1.0  # 0 where there was never a window
    points = preferences.ui_styles[0].widget.points if preferences.ui_styles else 11.0
    room = region_width() - (MARGIN + (ICON if icon != "NONE" else 0)) * scale
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(lines(sentence, int(room), points * scale)):
        column.label(text=line, icon="BLANK1" if number and icon != "NONE" else icon)


def fields(layout, owner=None, *names: str):
    """The layout, with labels beside what is entered; below each other the properties of an owner."""
    layout.use_property_split, layout.use_property_decorate = True, False
    for name in names:
        layout.prop(owner, name)
    return layout


def folded(layout, key: str, text: str):
    """What lies within a part that is folded away at first, under a heading; None while it is."""
    header, body = layout.panel(f"scan_relight_{key}", default_closed=True)
    header.label(text=text)
    return body


def region_width() -> int:
    """Pixels that the region is wide that is drawn."""
    region = bpy.context.region
    return region.width if region else 300


@lru_cache(maxsize=512)
def lines(sentence: str, width: int, size: float) -> tuple[str, ...]:
    """`sentence` cut at spaces into lines of at most `width` pixels; a word that is longer is cut itself.

    Parameters
    ----------
    sentence : str
    width : int
        In pixels.
    size : float
        Of the letters, in points times the interface's scale.
    """
    found, line = [], ""
    for word in sentence.split():
        longer = f"{line} {word}" if line else word
        if measure(longer, size) <= width:
            line = longer
            continue
        if line:
            found.append(line)
        while measure(word, size) > width and len(word) > 4:
            fits = max(next((n for n in range(len(word), 0, -1) if measure(word[:n], size) <= width), 4), 4)
            found.append(word[:fits])
            word = word[fits:]
        line = word
    return (*found, line) if line or not found else tuple(found)


def measure(words: str, size: float) -> float:
    """Width of `words` in pixels."""
    import blf

    blf.size(0, size)
    width = blf.dimensions(0, words)[0]
    return width if width > 0 else 0.55 * size * len(words)  # no font is loaded where there is no window


class SidebarPanel:
    """A part of the tab. `bl_order`: Capture 0, Recover 1, Results 2, Look 3, Relight 4, Export 5."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Scan Relight"
    bl_translation_context = translations.OWN
    manual = ""
    """Page of the documentation that "?" in the header opens; '' has none."""

    say = staticmethod(say)

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def draw_header_preset(self, context):
        if self.manual:
            self.layout.operator("scan_relight.manual", text="", icon="HELP", emboss=False).page = self.manual


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
    return bpy.types.UI_UL_list.sort_items_helper(list(enumerate(keys)), key=lambda pair: pair[1])
