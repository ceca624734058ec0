"""The modal half of the operators, played through without a window: what each event leads to."""

from __future__ import annotations

import sys
import threading
import time
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

DEAF = [sys.executable, "-c", "import time; time.sleep(60)"]
SHORT = [sys.executable, "-c", ""]
FAILS = [sys.executable, "-c", "import sys; sys.exit('scan-relight: The mesh is empty; scan again.')"]


class Manager:
    """Stands in for the window manager; counts timers."""

    def __init__(self):
        self.timers, self.windows = [], []

    def event_timer_add(self, period, window):
        self.timers.append(object())
        return self.timers[-1]

    def event_timer_remove(self, timer):
        self.timers.remove(timer)

    def modal_handler_add(self, operator):
        """Events are sent by the test."""


@pytest.fixture
def stage(module, ops):
    """An operator with a job, and a way to send it events."""
    job_operator = module("operators.base.job_operator")

    class Operator(job_operator.JobOperator):
        bl_label = "Recover"

        def __init__(self):
            self.reports, self.loaded, self.steps, self.tidied = [], None, 5, 0

        def report(self, kinds, text):
            self.reports.append((*kinds, text))

        def load(self, job):
            assert threading.current_thread() is not threading.main_thread()
            if isinstance(self.loaded, Exception):
                raise self.loaded
            return self.loaded

        def change(self, scene, loaded):
            assert threading.current_thread() is threading.main_thread()
            for k in range(self.steps):
                scene["changed"] = k + 1
                time.sleep(0.02)
                yield (k + 1) / self.steps
            return ("Object 3 was edited and is left as it is.",)

        def tidy(self, job):
            self.tidied += 1

    operator = Operator()
    area = SimpleNamespace(type="VIEW_3D", x=0, y=0, width=100, height=100, regions=[])
    window = SimpleNamespace(screen=SimpleNamespace(areas=[area]))
    context = SimpleNamespace(
        scene=bpy.context.scene, window=window, window_manager=Manager(), workspace=None, mode="OBJECT"
    )

    def send(kind="TIMER", value="PRESS", x=50):
        return operator.modal(context, SimpleNamespace(type=kind, value=value, mouse_x=x, mouse_y=50))

    def play(limit=30):
        end, verdict = time.monotonic() + limit, {"PASS_THROUGH"}
        while verdict & {"PASS_THROUGH", "RUNNING_MODAL"} and time.monotonic() < end:
            verdict = send()
            time.sleep(0.01)
        return verdict

    return SimpleNamespace(
        operator=operator,
        context=context,
        send=send,
        play=play,
        active=job_operator.active,
        bar=job_operator.bar,
        start=lambda command: operator.start(context, command, title="Recover"),
    )


def test_a_run_changes_the_scene_at_its_end(stage):
    stage.operator.loaded = object()
    assert stage.start(SHORT) == {"RUNNING_MODAL"} and stage.active() is stage.operator.job
    assert stage.play() == {"FINISHED"}
    assert bpy.context.scene["changed"] == 5 and stage.active() is None and stage.context.window_manager.timers == []
    assert stage.operator.reports[-1][0] == "INFO" and "1 warning, see the panel" in stage.operator.reports[-1][1]
    assert stage.operator.job.warnings == ["Object 3 was edited and is left as it is."] and stage.operator.tidied == 1


def test_a_run_that_changes_nothing_makes_no_undo_step(stage):
    stage.start(SHORT)
    assert stage.play() == {"CANCELLED"} and stage.operator.reports[-1][0] == "INFO"


def test_a_failure_is_told_in_one_sentence(stage):
    stage.start(FAILS)
    assert stage.play() == {"CANCELLED"}
    assert stage.operator.reports == [("ERROR", "The mesh is empty; scan again.")] and stage.active() is None


def test_escape_over_a_3d_view_stops_and_elsewhere_does_not(stage):
    stage.start(DEAF)
    assert stage.send("ESC", x=500) == {"PASS_THROUGH"} and not stage.operator.job.stopping
    assert stage.send("ESC", "RELEASE") == {"PASS_THROUGH"} and not stage.operator.job.stopping
    assert stage.send("ESC") == {"RUNNING_MODAL"}
    assert stage.bar(stage.operator.job)[1] == "Stopping"
    assert stage.play() == {"CANCELLED"}
    assert stage.operator.job.state == "stopped" and stage.operator.reports == [] and stage.operator.tidied == 1


def test_the_stop_button_stops(stage):
    assert not bpy.ops.scan_relight.stop.poll()
    stage.start(DEAF)
    assert bpy.ops.scan_relight.stop() == {"FINISHED"}
    assert stage.play() == {"CANCELLED"} and stage.operator.job.state == "stopped"


def test_other_events_pass(stage):
    stage.start(DEAF)
    assert stage.send("G") == stage.send("MOUSEMOVE") == stage.send("Z") == {"PASS_THROUGH"}


def test_nothing_passes_while_the_scene_changes(stage):
    """An undo in between would take away what is worked at."""
    stage.operator.loaded, stage.operator.steps = object(), 50
    stage.start(SHORT)
    while stage.operator.job.facts["phase"] != "change":
        stage.send()
        time.sleep(0.01)
    assert stage.send("Z") == {"RUNNING_MODAL"} and stage.send("LEFTMOUSE") == {"RUNNING_MODAL"}
    stage.send()
    assert 0 < bpy.context.scene["changed"] < 50
    assert stage.send("ESC") == {"FINISHED"}, "what is there is one undo step"
    assert "undo takes back" in stage.operator.reports[-1][1] and stage.active() is None


def test_a_scene_that_is_gone_is_told(stage):
    stage.operator.loaded = object()
    stage.start(SHORT)
    bpy.data.scenes.new("other")
    bpy.data.scenes.remove(bpy.context.scene)
    stage.operator.job.facts["result_folder"] = "/somewhere"
    assert stage.play() == {"CANCELLED"}
    assert stage.operator.reports[-1] == (
        "ERROR",
        "The scene that the run was started for is gone; its result lies in '/somewhere'.",
    )


def test_a_renamed_scene_is_found(stage):
    stage.operator.loaded = object()
    stage.start(SHORT)
    bpy.context.scene.name = "called otherwise"
    assert stage.play() == {"FINISHED"} and bpy.context.scene["changed"] == 5


def test_the_result_waits_for_object_mode(stage):
    stage.operator.loaded, stage.context.mode = object(), "EDIT_MESH"
    stage.start(SHORT)
    for _ in range(100):
        assert stage.send() == {"PASS_THROUGH"}
        if stage.operator.job.facts["phase"] == "wait":
            break
        time.sleep(0.02)
    assert "leave the editing mode" in stage.bar(stage.operator.job)[1] and "changed" not in bpy.context.scene
    stage.context.mode = "OBJECT"
    assert stage.play() == {"FINISHED"}


def test_another_file_ends_the_run(stage, module):
    stage.start(DEAF)
    job = stage.operator.job
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert module("addon.bridge.job.job").current() is None
    assert stage.send() == {"CANCELLED"}
    assert job.wait(30) and job.state == "stopped"


def test_a_closed_window_ends_the_run(stage):
    stage.start(DEAF)
    stage.operator.cancel(stage.context)
    assert stage.operator.job.wait(30) and stage.active() is None and stage.context.window_manager.timers == []


def test_a_damaged_result_is_told(stage, module):
    stage.operator.loaded = module("addon.core.errors").BadInputError("The result in 'there' is damaged.")
    stage.start(SHORT)
    assert stage.play() == {"CANCELLED"}
    assert stage.operator.reports == [("ERROR", "The result in 'there' is damaged.")]


def test_an_error_that_nobody_foresaw_is_one_sentence(stage, tmp_path):
    stage.operator.loaded = KeyError("told")
    stage.start(SHORT)
    stage.operator.job.facts["result_folder"] = str(tmp_path)
    assert stage.play() == {"CANCELLED"}
    [(kind, sentence)] = stage.operator.reports
    assert kind == "ERROR" and sentence.startswith("Unexpected error (KeyError") and (tmp_path / "error.log").exists()
