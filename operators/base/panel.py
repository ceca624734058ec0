"""Shared by all panels of the sidebar's tab "Scan Relight"; Blender cuts labels off at the panel's edge, so that
sentences are wrapped.
"""

from functools import lru_cache

import bpy

from ...addon.core.kinds import Shown
from ...addon.core.naming import numbered
from .. import translations

MARGIN: Shown[int] = 68
"""Width of the tabs, the panel's edges and paddings, in pixels at an interface scale of 1."""
ICON: Shown[int] = 20


def say(layout, sentence: str, icon: str = "NONE") -> None:
    """Draw `sentence` wrapped to the region's width; the icon is before the first line."""
    sentence = translations.translated(sentence)
    preferences = bpy.context.preferences
    scale = preferences.system.ui_scale or 1.0  # 0 without a window
    points = preferences.ui_styles[0].widget.points if preferences.ui_styles else 11.0
    width = region_width() - (MARGIN + (ICON if icon != "NONE" else 0)) * scale
    column = layout.column(align=True)
    column.scale_y = 0.8
    for index, line in enumerate(lines(sentence, int(width), points * scale)):
        column.label(text=line, icon="BLANK1" if index and icon != "NONE" else icon)


def fields(layout, owner=None, *names: str):
    """The layout, with split labels; draws the named properties of an owner below each other."""
    layout.use_property_split, layout.use_property_decorate = True, False
    for name in names:
        layout.prop(owner, name)
    return layout


def folded(layout, key: str, text: str):
    """The body of a sub-panel that is closed by default, under a heading; None while it is closed."""
    header, body = layout.panel(f"scan_relight_{key}", default_closed=True)
    header.label(text=text)
    return body


def region_width() -> int:
    """Width of the current region in pixels."""
    region = bpy.context.region
    return region.width if region else 300


@lru_cache(maxsize=512)
def lines(sentence: str, width: int, size: float) -> tuple[str, ...]:
    """`sentence` cut at spaces into lines of at most `width` pixels; a longer word is cut.

    Parameters
    ----------
    sentence : str
    width : int
        In pixels.
    size : float
        Of the font, in points times the interface's scale.
    """
    result, line = [], ""
    for word in sentence.split():
        candidate = f"{line} {word}" if line else word
        if measure(candidate, size) <= width:
            line = candidate
            continue
        if line:
            result.append(line)
        while measure(word, size) > width and len(word) > 4:
            length = max(next((n for n in range(len(word), 0, -1) if measure(word[:n], size) <= width), 4), 4)
            result.append(word[:length])
            word = word[length:]
        line = word
    return (*result, line) if line or not result else tuple(result)


def measure(words: str, size: float) -> float:
    """Width of `words` in pixels."""
    import blf

    blf.size(0, size)
    width = blf.dimensions(0, words)[0]
    return width if width > 0 else 0.55 * size * len(words)  # no font is loaded without a window


class SidebarPanel:
    """A panel of the tab. `bl_order`: Capture 0, Recover 1, Results 2, Look 3, Relight 4, Export 5."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Scan Relight"
    bl_translation_context = translations.OWN
    manual = ""
    """Page of the documentation for "?" in the header; '' without."""

    say = staticmethod(say)

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def draw_header_preset(self, context):
        if self.manual:
            self.layout.operator("scan_relight.manual", text="", icon="HELP", emboss=False).page = self.manual


def draw_name(layout, name: str, icon: str = "NONE") -> None:
    """Draw an object's name in a list; its number has its own column, so that a narrow panel never cuts it off."""
    kind, number = numbered(name)
    row = layout.row()
    row.label(text=kind, icon=icon, translate=False)
    if number:
        number_row = row.row()
        number_row.alignment = "RIGHT"
        number_row.ui_units_x = 0.5 + 0.45 * len(number)
        number_row.label(text=number, translate=False)


def places(keys: list) -> list[int]:
    """New index of each of `keys` in sorted order, as `UIList.filter_items` returns it."""
    return bpy.types.UI_UL_list.sort_items_helper(list(enumerate(keys)), key=lambda pair: pair[1])
