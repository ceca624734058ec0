"""What is done to a run that goes on: another file, the window's end. Neither harms the other."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

JOB = "module('addon.bridge.job.job').current()"


@pytest.fixture
def running(open_window, tiny_capture, tmp_path):
    """A window with a run that has come to the light, and the run's process."""
    window = open_window()
    window.ask(f"""
choices = bpy.context.scene.scan_relight
choices.capture_folder, choices.result_folder = {str(tiny_capture)!r}, {str(tmp_path / "result")!r}
choices.preset = "draft"
choices.settings.shading_rays = 1 << 20
with bpy.context.temp_override(**place()):
    bpy.ops.scan_relight.run("INVOKE_DEFAULT", target="recover")
""")
    window.wait_for(f"{JOB}.stage == 'shading'")
    yield window, window.ask(f"{JOB}._process.pid")
    window.close()


def goes(process: int, patience: float = 30.0) -> bool:
    """Whether a process ends."""
    until = time.monotonic() + patience
    while time.monotonic() < until:
        try:
            os.kill(process, 0)
            if Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (OSError, IndexError):
            return True
        time.sleep(0.1)
    return False


def test_another_file_ends_the_run_and_nothing_else(running, tmp_path, recovered):
    window, process = running
    window.ask(f"bpy.ops.wm.open_mainfile(filepath={str(recovered / 'scene.blend')!r})")
    assert goes(process)
    window.ask("open_tab()")
    assert window.ask(f"{JOB}") is None
    assert window.ask("sum('object_id' in thing for thing in bpy.context.scene.objects)") == 15
    assert {"surface.npz", "lit_diffuse.npz"} <= {path.name for path in (tmp_path / "result" / "stages").iterdir()}
    assert window.ask("bpy.ops.scan_relight.stop.poll()") is False


def test_edits_and_undo_leave_the_run_alone(running):
    window, process = running
    window.ask("""
with bpy.context.temp_override(**place()):
    bpy.ops.mesh.primitive_cube_add("INVOKE_DEFAULT", True)
""")
    window.key("ctrl+z")
    window.wait_for("len(bpy.data.objects) == 3")
    assert window.ask(f"{JOB}.running") and not goes(process, patience=0.3)
    window.click("scan_relight.stop(")
    window.wait_for("module('operators.base.job_operator').active() is None")
    assert window.ask(f"{JOB}.state") == "stopped" and goes(process)


def test_blenders_end_ends_the_run(running):
    window, process = running
    window.tell("bpy.ops.wm.quit_blender()")
    assert window.process.wait(30) == 0, window.log
    assert goes(process)
