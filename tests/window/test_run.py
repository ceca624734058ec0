"""A run from the panel: progress, ESC in the middle, on to the end, undo and redo, save and reopen. One story."""

from __future__ import annotations

import hashlib
import json
import time

import pytest

JOB = "module('addon.bridge.job.job').current()"
ACTIVE = "module('operators.base.job_operator').active()"
ROOM = "sum('object_id' in thing for thing in bpy.data.objects)"
RAYS = 256
"""So many that a run is not over before ESC arrives."""
OWN = 0.1
"""Seconds of the processor that one call of our own code may take from the window."""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """The run's result folder."""
    return tmp_path_factory.mktemp("panel") / "result"


def test_an_idle_window_as_a_measure(window, figures):
    window.ask("watch_own_code()")
    time.sleep(4)
    figures["idle"] = {"stalls_over_100_ms": window.ask("watched()['stalls']")}
    assert window.ask("watched()['phases'][-1][1]") == "none"


def test_escape_stops_a_run_and_keeps_what_is_finished(window, tiny_capture, result, pictures, figures):
    window.ask(f"""
choices = bpy.context.scene.scan_relight
choices.capture_folder, choices.result_folder = {str(tiny_capture)!r}, {str(result)!r}
choices.preset = "draft"
choices.settings.shading_rays = {RAYS}
""")
    # Rows move when it is known what the capture holds: a button found before is not pressed after.
    window.wait_for("isinstance(module('operators.recover.findings').look(bpy.context.scene.scan_relight), dict)")
    window.click("scan_relight.run(", "'recover'")
    window.ask("pause_in('shading')")  # drawn by software, the window is slower than the run
    window.picture(pictures / "04-progress.png")
    window.picture(pictures / "04-progress-sidebar.png", sidebar=True)
    window.ask(f"os.kill({JOB}._process.pid, signal.SIGCONT)")
    pressed = window.key("Escape")
    window.wait_for(f"{ACTIVE} is None")
    assert window.ask(f"{JOB}.state") == "stopped"
    assert window.ask(ROOM) == 0, "a stopped run changed the scene"
    assert {"surface.npz", "lit_diffuse.npz"} <= {path.name for path in (result / "stages").iterdir()}
    assert not (result / "scene.blend").exists()
    ended = next(when for when, phase in window.ask("watched()['phases']") if phase.startswith("end/"))
    figures["escape"] = {"seconds_until_the_panel_is_free": round(ended - pressed, 3)}
    window.picture(pictures / "05-stopped-sidebar.png", sidebar=True)


def test_the_next_run_goes_on_to_the_end(window, result, pictures, figures):
    window.ask("watch_own_code()")
    window.click("scan_relight.run(", "'recover'")
    window.wait_for(f"{JOB}.running")
    window.wait_for(f"{ACTIVE} is None", patience=300)
    assert window.ask(f"{JOB}.state") == "done", window.ask(f"{JOB}.sentence")
    assert window.ask(ROOM) == 15
    stages = json.loads((result / "report.json").read_text())["stages"]
    assert stages["surface"]["stored"] and stages["lit_diffuse"]["stored"] and not stages["specular"].get("stored")
    watched = window.ask("watched()")
    figures["run"] = {
        "stalls_over_100_ms": watched["stalls"],
        "calls_of_our_own": watched["calls"],
        "longest_of_our_own": dict(sorted(watched["own"].items(), key=lambda one: -one[1]["processor"])),
    }
    window.picture(pictures / "06-finished.png")
    window.picture(pictures / "06-finished-sidebar.png", sidebar=True)
    slow = {name: one for name, one in watched["own"].items() if one["processor"] > OWN}
    assert watched["calls"] > 20 and not slow, slow


def test_one_undo_takes_the_room_back_and_redo_brings_it(window, pictures):
    before = window.ask("sorted(thing.name for thing in bpy.data.objects)")
    window.key("ctrl+z")
    window.wait_for(f"{ROOM} == 0")
    assert window.ask("sorted(thing.name for thing in bpy.data.objects)") == ["Camera", "Cube", "Light"]
    window.picture(pictures / "07-undone.png")
    window.key("ctrl+shift+z")
    window.wait_for(f"{ROOM} == 15")
    assert window.ask("sorted(thing.name for thing in bpy.data.objects)") == before


def test_the_artists_path_leads_where_the_command_line_does(result, recovered):
    names = {path.relative_to(recovered).as_posix() for path in recovered.rglob("*.exr")}
    assert "albedo.exr" in names or any("albedo" in name for name in names)
    for name in sorted(names):
        one, other = ((folder / name).read_bytes() for folder in (result, recovered))
        assert hashlib.sha256(one).hexdigest() == hashlib.sha256(other).hexdigest(), name
    mine, theirs = (json.loads((folder / "materials.json").read_text()) for folder in (result, recovered))
    assert mine == theirs


def test_a_saved_file_holds_the_choices_and_nothing_of_the_run(window, result, tmp_path, pictures):
    file = tmp_path / "room.blend"
    window.ask(f"bpy.ops.wm.save_as_mainfile(filepath={str(file)!r})")
    window.ask(f"bpy.ops.wm.open_mainfile(filepath={str(file)!r})")
    window.ask("open_tab()")
    kept = window.ask("""
choices = bpy.context.scene.scan_relight
answer = choices.result_folder, choices.preset, list(choices.bl_rna.properties.keys())
""")
    assert kept[:2] == [str(result), "draft"]
    assert not {"job", "progress", "state", "running"} & set(kept[2])
    assert window.ask(JOB) is None and window.ask(ROOM) == 15
    assert window.ask("bpy.ops.scan_relight.look.poll() and bpy.ops.scan_relight.switch_lamps.poll()")
    window.click("scan_relight.look(", "'ALBEDO'", across=(0.75,))
    window.wait_for("module('addon.bridge.results.look').current(bpy.context.scene) == 'ALBEDO'")
    window.click("scan_relight.switch_lamps(", "on=False", top=False, across=(0.75,))
    lamps = "module('addon.bridge.light.lamps')"
    window.wait_for(f"not any({lamps}.is_on(one) for one in {lamps}.find_lamps(bpy.context.scene))")
    window.picture(pictures / "08-reopened.png")
