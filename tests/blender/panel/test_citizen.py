"""What Blender's own places know of us: menus, search, keys, the manual, assets."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote, urlparse

import pytest

bpy = pytest.importorskip("bpy")

ROOT = Path(__file__).resolve().parents[3]


class Menu:
    """Remembers the operators of a menu."""

    def __init__(self):
        self.operators = []

    def operator(self, name):
        self.operators.append(name)


def test_every_operator_is_where_the_search_looks(package, ops, module):
    """In the menu, unless it is part of another or needs what only a list knows; under labels that differ."""
    menus = module("operators.menus")
    menu = Menu()
    menus.SCAN_RELIGHT_MT_all.draw(SimpleNamespace(layout=menu), bpy.context)
    registered = {f"scan_relight.{name}" for name in dir(ops)}
    hidden = {f"scan_relight.{name}" for name in (*menus.NEED_MORE, "use_folder", "drop")}
    assert set(menu.operators) >= {
        f"scan_relight.{name}"
        for name in (
            "recover",
            "run",
            "stop",
            "open_capture",
            "open_result",
            "export",
            "before_after",
            "manual",
            "mark_assets",
        )
    }
    inner = {
        name
        for name in registered
        if "INTERNAL" in getattr(getattr(bpy.types, "SCAN_RELIGHT_OT_" + name.partition(".")[2]), "bl_options", ())
    }
    assert registered - set(menu.operators) == hidden | inner
    labels = [getattr(ops, name.partition(".")[2]).get_rna_type().name for name in menu.operators]
    assert len(set(labels)) == len(labels) and {"Recover Capture", "Export Room"} <= set(labels)


def test_the_menu_hangs_in_object(package, ops):
    assert any("scan_relight" in one.__module__ for one in bpy.types.VIEW3D_MT_object.draw._draw_funcs)


def manual(name):
    """Where Blender's Online Manual leads for one of its names."""
    viewer = importlib.import_module("bl_operators.wm").WM_OT_doc_view_manual
    return viewer._lookup_rna_url(name, verbose=False)


@pytest.mark.parametrize(
    "name",
    [
        "bpy.ops.scan_relight.recover",
        "bpy.ops.scan_relight.export",
        "bpy.ops.scan_relight.add_light",
        "bpy.types.ScanRelightScene.preset",
        "bpy.types.ScanRelightSettings.shading_rays",
        "bpy.types.ScanRelightReading.reading_mesh",
        "bpy.types.ScanRelightStudio.aim",
        "bpy.types.ScanRelightPreferences.threads",
    ],
)
def test_the_online_manual_leads_to_pages_that_are_there(package, ops, name):
    found = urlparse(manual(name))
    assert found.scheme == "file" and Path(unquote(found.path)).is_file()


def test_every_part_that_is_linked_is_a_heading(package, ops, module):
    """Of the manual map and of the panels' "?"."""
    from scan_relight import operators

    anchor = re.compile(r"[^\w\- ]")
    pages = {page for _, page in module("operators.manual").MAP}
    pages |= {cls.manual for cls in operators.classes() if getattr(cls, "manual", "")}
    assert len(pages) > 5
    for page in pages:
        name, _, part = page.partition("#")
        text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
        headings = {
            anchor.sub("", line.lstrip("# ").lower()).strip().replace(" ", "-")
            for line in text.splitlines()
            if line.startswith("#")
        }
        assert not part or part in headings, page


def test_the_manual_tells_where_it_lies(ops):
    assert ops.manual(page="panel#capture") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="no page 'nothing'"):
        ops.manual(page="nothing")


def test_the_keys_are_of_operators_and_properties_that_there_are(package, ops, module):
    """Without a keyboard nothing is registered, so what would be is asked for here."""
    keymaps = module("operators.keymaps")
    assert len(keymaps.ENTRIES) == len(keymaps.LABELS)
    for name, properties in keymaps.ENTRIES:
        known = getattr(ops, name.partition(".")[2]).get_rna_type().properties
        assert set(properties) <= set(known.keys())


@pytest.mark.parametrize("name", ["recover", "import_capture", "open_capture", "export"])
def test_operators_with_settings_have_presets_that_keep_no_folder(package, ops, name):
    assert "PRESET" in getattr(bpy.types, f"SCAN_RELIGHT_OT_{name}").bl_options
    properties = getattr(ops, name).get_rna_type().properties
    paths = [
        prop
        for prop in properties
        if prop.type == "STRING" and prop.identifier in ("capture_folder", "result_folder", "filepath", "directory")
    ]
    assert paths and all(prop.is_skip_preset or prop.is_skip_save for prop in paths)
