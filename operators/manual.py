"""The documentation bundled with the extension: "?" in the panels, and Blender's own Online Manual (right click)."""

from pathlib import Path

import bpy

from .base.properties import string_property

DOCS = Path(__file__).resolve().parent.parent / "docs"
"""Installed: HTML pages. In a checkout: the Markdown that they are made of."""
MAP = (
    ("bpy.ops.scan_relight.refit*", "corrections"),
    ("bpy.ops.scan_relight.this_is*", "corrections"),
    ("bpy.ops.scan_relight.same_as*", "corrections"),
    ("bpy.ops.scan_relight.take_back*", "corrections"),
    ("bpy.ops.scan_relight.*white*", "corrections#a-known-white"),
    ("bpy.ops.scan_relight.*unseen*", "corrections#unseen-spots"),
    ("bpy.ops.scan_relight.*painted*", "corrections#unseen-spots"),
    ("bpy.ops.scan_relight.smooth*", "corrections#smooth-shading"),
    ("bpy.ops.scan_relight.export*", "relighting#export"),
    ("bpy.ops.scan_relight.*light*", "relighting"),
    ("bpy.ops.scan_relight.*lamp*", "relighting"),
    ("bpy.ops.scan_relight.*virtual*", "relighting"),
    ("bpy.ops.scan_relight.*place*", "relighting"),
    ("bpy.ops.scan_relight.match_frame*", "relighting"),
    ("bpy.ops.scan_relight.before_after*", "relighting"),
    ("bpy.ops.scan_relight.capture_from_scene*", "own_scene"),
    ("bpy.ops.scan_relight.restore_materials*", "own_scene"),
    ("bpy.ops.scan_relight.open_report*", "evidence"),
    ("bpy.ops.scan_relight.*capture*", "panel#capture"),
    ("bpy.ops.scan_relight.*", "panel#recover"),
    ("bpy.types.scanrelightcorrect*", "corrections"),
    ("bpy.types.scanrelightreading.*", "captures"),
    ("bpy.types.scanrelightlamp.*", "relighting"),
    ("bpy.types.scanrelightoutside.*", "relighting"),
    ("bpy.types.scanrelightstudio.*", "relighting"),
    ("bpy.types.scanrelightpreferences.*", "panel#preferences"),
    ("bpy.types.scanrelight*", "panel#recover"),
)
"""Blender's names of operators and properties, lower case, and the page of each; the first match counts."""


def file_name(page: str) -> str:
    """The file of a page such as 'panel#recover', with its anchor."""
    name, separator, anchor = page.partition("#")
    extension = "html" if (DOCS / f"{name}.html").is_file() else "md"
    return f"{name}.{extension}{separator}{anchor}"


def manual_map() -> tuple[str, tuple[tuple[str, str], ...]]:
    """Callback of `bpy.utils.register_manual_map`."""
    return f"{DOCS.as_uri()}/", tuple((pattern, file_name(page)) for pattern, page in MAP)


class SCAN_RELIGHT_OT_manual(bpy.types.Operator):
    """Open the documentation in the browser; it came with the extension and needs no network"""

    bl_label = "Scan Relight Manual"

    page: string_property("Page", "Which page, and which part of it", default="guide", options={"SKIP_SAVE"})

    def execute(self, context):
        """Open it; in the background only report its address."""
        name = file_name(self.page)
        if not (DOCS / name.partition("#")[0]).is_file():
            self.report({"ERROR"}, f"The documentation has no page '{self.page}'; install the extension again.")
            return {"CANCELLED"}
        address = f"{DOCS.as_uri()}/{name}"
        if bpy.app.background:
            self.report({"INFO"}, address)
            return {"FINISHED"}
        return bpy.ops.wm.url_open(url=address)
