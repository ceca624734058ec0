"""From the zip to the tab: what an artist sees before anything was recovered."""

from __future__ import annotations

import shutil

PARTS = {"Missing", "Capture", "Recover", "Results", "Look", "Relight", "Export"}


def test_the_tab_stands_in_the_sidebar(window, pictures):
    assert window.ask("place('UI')['region'].active_panel_category") == "Scan Relight"
    names = window.ask(
        "[cls.bl_label for name in dir(bpy.types) if name.startswith('SCAN_RELIGHT_PT_')"
        " for cls in [getattr(bpy.types, name)] if not getattr(cls, 'bl_parent_id', '')]"
    )
    assert set(names) == PARTS
    picture = window.picture(pictures / "01-empty.png")
    assert len(picture.getcolors(1 << 24)) > 50, "the picture is blank"
    window.picture(pictures / "01-empty-sidebar.png", sidebar=True)


def test_nothing_can_be_pressed_too_early(window):
    polls = window.ask("""
answer = {}
with bpy.context.temp_override(**place()):
    for name in ("run", "check_capture", "stop", "look", "before_after", "add_light", "open_report"):
        answer[name] = getattr(bpy.ops.scan_relight, name).poll()
""")
    assert not any(polls.values()), polls


def test_a_folder_that_is_typed_in_is_read_at_once(window, tiny_capture, pictures):
    x, y = window.ask("find(('scan_relight.capture_folder',), across=(0.3,))")
    window.click_at(x, y)
    window.click_at(x, y)
    window.press("ctrl+a")
    window.write(str(tiny_capture))
    window.press("Return")
    assert window.ask("bpy.context.scene.scan_relight.capture_folder").rstrip("/") == str(tiny_capture)
    window.wait_for("isinstance(module('operators.recover.findings').look(bpy.context.scene.scan_relight), dict)")
    found = window.ask("module('operators.recover.findings').look(bpy.context.scene.scan_relight)")
    assert found["frames"] == 10 and len(found["instances"]) == 15
    window.picture(pictures / "02-capture-sidebar.png", sidebar=True)


def test_a_bad_capture_says_what_is_wrong_and_what_to_do(window, grey_capture, tmp_path, pictures):
    bad = shutil.copytree(grey_capture, tmp_path / "scan")
    (bad / "mesh.ply").unlink()
    window.ask(f"setattr(bpy.context.scene.scan_relight, 'capture_folder', {str(bad)!r})")
    told = window.wait_for(
        "(lambda found: found if isinstance(found, str) else None)"
        "(module('operators.recover.findings').look(bpy.context.scene.scan_relight))"
    )
    assert "mesh" in told and str(bad) in told
    window.picture(pictures / "03-bad-capture-sidebar.png", sidebar=True)
    shutil.copy(grey_capture / "mesh.ply", bad)
    (bad / "transforms.json").write_text("{")
    window.click("scan_relight.check_capture")
    window.wait_for(
        "'transforms.json' in str(module('operators.recover.findings').look(bpy.context.scene.scan_relight))"
    )
    window.picture(pictures / "03-bad-poses-sidebar.png", sidebar=True)
