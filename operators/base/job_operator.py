"""Long work behind Blender's window: a job of its own process that an operator follows, and what it brings in.

The operator keeps no reference to Blender's data while the job runs: undo, other scenes and other files are the
artist's as ever. ESC over a 3D view stops it.
"""

import threading
import time
from collections.abc import Generator, Iterator

import bpy

from ...addon.bridge.job import job as jobs
from ...addon.console import duration, unexpected
from ...addon.core.errors import ScanRelightError
from ...addon.core.kinds import Shown
from ...addon.core.stages import LABELS
from ..translations import told

FOLLOWED = {"progress": "json", "stop_with_stdin": True}
"""Options of a command that an operator follows."""
PERIOD: Shown[float] = 0.1
HURRY: Shown[float] = 0.01
"""Seconds between two looks at the job, and between two slices of what it brings."""
REDRAW: Shown[float] = 0.5
"""Seconds between two pictures of the progress bar, unless the stage changes: drawing is the window's time."""
SLICE: Shown[float] = 0.04
"""Seconds that the scene is worked at before the window is drawn again."""


def progress_text(job: jobs.Job) -> str:
    """Stage, its share, and the time left, for a progress bar."""
    if job.stopping:
        return told("Stopping")
    text, left = told("Starting"), job.seconds_left
    if job.stage:
        text = f"{told(LABELS.get(job.stage, job.stage.replace('_', ' ').capitalize()))} {job.share:.0%}"
    return text if left is None else f"{text}, {told(f'{duration(left)} left')}"


def areas(context, kind: str) -> list[bpy.types.Area]:
    """The areas of a kind in all windows."""
    return [one for window in context.window_manager.windows for one in window.screen.areas if one.type == kind]


def redraw(context) -> None:
    """Have the sidebars of all 3D views and the status bars drawn again, and nothing else."""
    bpy.msgbus.publish_rna(key=(bpy.types.Window, "view_layer"))  # what status bars listen to
    for area in areas(context, "VIEW_3D"):
        for region in area.regions:
            if region.type == "UI":
                region.tag_redraw()


def under_mouse(event, parts) -> Iterator:
    """Those of areas or regions that the mouse is in."""
    for one in parts:
        if 0 <= event.mouse_x - one.x < one.width and 0 <= event.mouse_y - one.y < one.height:
            yield one


def over_3d_view(context, event) -> bool:
    """Whether the mouse is in a 3D view."""
    there = context.window.screen.areas if context.window is not None else ()
    return any(area.type == "VIEW_3D" for area in under_mouse(event, there))


class JobOperator:
    """The modal half of an operator. Its job's `facts` hold what panels tell of it."""

    job: jobs.Job | None = None

    def start(self, context, command: list[str], **facts) -> set[str]:
        """Start `command` as the current job and follow it; what `execute` or `invoke` returns."""
        self.job = jobs.begin(command, phase="run", scene=context.scene.session_uid, **facts)
        self._slices = self._loader = self._ready = self._said = self._state = None
        self._drawn = 0.0
        self._timer = context.window_manager.event_timer_add(PERIOD, window=context.window)
        context.window_manager.modal_handler_add(self)
        redraw(context)
        return {"RUNNING_MODAL"}

    def load(self, job: jobs.Job):
        """What the scene's change needs, in a thread of its own: no Blender here. None changes nothing."""
        return None

    def change(self, scene, loaded) -> Generator[float, None, tuple[str, ...]]:
        """Change the scene in slices; returns warnings."""
        yield 1.0
        return ()

    def modal(self, context, event):
        if self._timer is None:  # it has ended, and a window that it opened has Blender ask once more
            return {"FINISHED"}
        job = self.job
        if job is not jobs.current():  # another file was loaded
            return self._leave(context, {"CANCELLED"})
        stop = event.type == "ESC" and event.value == "PRESS" and over_3d_view(context, event)
        try:
            if job.facts["phase"] == "change":
                return self._go_on(context, event, stop)
            if stop:
                job.stop()
                job.facts["unwanted"] = True  # whatever it brings
                self._tell(context)
                return {"RUNNING_MODAL"}
            if event.type == "TIMER":
                return self._look(context) or {"PASS_THROUGH"}
        except ScanRelightError as error:
            return self._fail(context, str(error))
        except Exception as error:  # the last line of defence: a sentence, never a bare traceback
            return self._fail(context, unexpected(error, job.facts.get("result_folder")))
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """Blender ends the operator: it closes, or its window does."""
        self.job.stop()
        self._leave(context, set())

    def tidy(self, job: jobs.Job) -> None:
        """Put away what only this job needed; called at its end, whatever that is."""

    def _look(self, context):
        job = self.job
        self._tell(context)
        if job.running:
            return None
        if job.state == jobs.FAILED:
            return self._fail(context, job.sentence)
        if job.state == jobs.STOPPED or job.facts.get("unwanted"):
            return self._leave(context, {"CANCELLED"})
        if self._loader is None:
            job.facts["phase"] = "load"
            self._loader = threading.Thread(target=self._load, name="scan relight load", daemon=True)
            self._loader.start()
        if self._loader.is_alive():
            return None
        if isinstance(self._ready, Exception):
            raise self._ready
        if self._ready is None:
            return self._done(context, (), {"CANCELLED"})  # nothing has changed: no undo step
        if context.mode != "OBJECT":
            job.facts["phase"] = "wait"
            return None
        scene = next((one for one in bpy.data.scenes if one.session_uid == job.facts["scene"]), None)
        if scene is None:
            where = job.facts.get("result_folder")
            return self._fail(
                context,
                "The scene that the run was started for is gone"
                + (f"; its result lies in '{where}'." if where else "."),
            )
        job.facts["phase"], job.facts["changed"] = "change", 0.0
        self._slices = self.change(scene, self._ready)
        context.window_manager.event_timer_remove(self._timer)
        self._timer = context.window_manager.event_timer_add(HURRY, window=context.window)
        return None

    def _load(self) -> None:
        try:
            self._ready = self.load(self.job)
        except Exception as error:  # raised again where it can be told
            self._ready = error

    def _go_on(self, context, event, stop: bool):
        """Work at the scene for one slice; nothing else reaches Blender's data until it is done."""
        if stop:
            self._slices.close()
            self.report({"WARNING"}, "Stopped while the result came in; undo takes back what has come.")
            return self._leave(context, {"FINISHED"})
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        until = time.monotonic() + SLICE
        while time.monotonic() < until:
            try:
                self.job.facts["changed"] = next(self._slices)
            except StopIteration as end:
                return self._done(context, end.value or (), {"FINISHED"})
        self._tell(context)
        return {"RUNNING_MODAL"}

    def _done(self, context, warnings, verdict: set[str]):
        job = self.job
        job.warnings.extend(one for one in warnings if one not in job.warnings)
        count = len(job.warnings)
        also = f"; {count} warning{'s' * (count > 1)}, see the panel" if count else ""
        self.report({"INFO"}, f"{self.bl_label}: done in {duration(job.seconds)}{also}.")
        return self._leave(context, verdict)

    def _fail(self, context, sentence: str):
        half = self.job.facts["phase"] == "change"
        self.job.facts["failed"] = sentence
        self.report({"ERROR"}, sentence)
        return self._leave(context, {"FINISHED"} if half else {"CANCELLED"})

    def _tell(self, context) -> None:
        job = self.job
        text, now = bar(job)[1], time.monotonic()
        state = job.stage, job.state, job.stopping, job.facts["phase"]
        if text == self._said or (state == self._state and now - self._drawn < REDRAW):
            return
        self._said, self._state, self._drawn = text, state, now
        redraw(context)

    def _leave(self, context, verdict: set[str]) -> set[str]:
        self.job.facts["phase"] = "end"
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        self.tidy(self.job)
        redraw(context)
        return verdict


def bar(job: jobs.Job) -> tuple[float, str]:
    """Share and text of the one progress bar."""
    phase = job.facts.get("phase")
    if phase == "change":
        return job.facts["changed"], told("Into the scene")
    if phase == "load":
        return 1.0, told("Loading the result")
    if phase == "wait":
        return 1.0, told("Done; leave the editing mode to bring it in")
    return job.overall, progress_text(job)


def active() -> jobs.Job | None:
    """The job whose operator has not ended yet, or None."""
    job = jobs.current()
    return job if job is not None and job.facts.get("phase") != "end" else None


class SCAN_RELIGHT_OT_stop(bpy.types.Operator):
    """Stop the run within a second; finished stages are kept and the next run goes on from them"""

    bl_label = "Stop Recovery"

    @classmethod
    def poll(cls, context):
        if active() is None:
            cls.poll_message_set("No run is going on.")
            return False
        return True

    def execute(self, context):
        """Ask for it; the operator that follows the job sees its end."""
        job = active()
        job.stop()
        job.facts["unwanted"] = True
        redraw(context)
        return {"FINISHED"}


@bpy.app.handlers.persistent
def forget_job(*_) -> None:
    """Another file comes: the run that was started for this one ends."""
    jobs.forget()
