"""Long work in the background of Blender's window: a job in its own process, followed by a modal operator.

The operator keeps no reference to Blender's data while the job runs: undo, other scenes and other files stay
available. ESC over a 3D view stops it.
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
from ..translations import translated

FOLLOWED = {"progress": "json", "stop_with_stdin": True}
"""Options of a command that is followed by an operator."""
PERIOD: Shown[float] = 0.1
CHANGE_PERIOD: Shown[float] = 0.01
"""Seconds between two polls of the job, and between two slices of the change to the scene."""
REDRAW: Shown[float] = 0.5
"""Seconds between two redraws of the progress bar, unless the stage changes: drawing blocks the window."""
SLICE: Shown[float] = 0.04
"""Seconds of work on the scene between two redraws of the window."""


def progress_text(job: jobs.Job) -> str:
    """Stage, its share, and the time left, for a progress bar."""
    if job.stopping:
        return translated("Stopping")
    text, left = translated("Starting"), job.seconds_left
    if job.stage:
        text = f"{translated(LABELS.get(job.stage, job.stage.replace('_', ' ').capitalize()))} {job.share:.0%}"
    return text if left is None else f"{text}, {translated(f'{duration(left)} left')}"


def areas(context, kind: str) -> list[bpy.types.Area]:
    """The areas of a kind in all windows."""
    return [area for window in context.window_manager.windows for area in window.screen.areas if area.type == kind]


def redraw(context) -> None:
    """Redraw the sidebars of all 3D views and the status bars, and nothing else."""
    bpy.msgbus.publish_rna(key=(bpy.types.Window, "view_layer"))  # what status bars listen to
    for area in areas(context, "VIEW_3D"):
        for region in area.regions:
            if region.type == "UI":
                region.tag_redraw()


def under_mouse(event, parts) -> Iterator:
    """The areas or regions under the mouse."""
    for part in parts:
        if 0 <= event.mouse_x - part.x < part.width and 0 <= event.mouse_y - part.y < part.height:
            yield part


def over_3d_view(context, event) -> bool:
    """Whether the mouse is in a 3D view."""
    screen_areas = context.window.screen.areas if context.window is not None else ()
    return any(area.type == "VIEW_3D" for area in under_mouse(event, screen_areas))


class JobOperator:
    """The modal half of an operator. Its job's `facts` are for panels."""

    job: jobs.Job | None = None

    def start(self, context, command: list[str], **facts) -> set[str]:
        """Start `command` as the current job and follow it; returns the result of `execute` or `invoke`."""
        self.job = jobs.begin(command, phase="run", scene=context.scene.session_uid, **facts)
        self._changes = self._loader = self._loaded = self._last_text = self._state = None
        self._drawn_at = 0.0
        self._timer = context.window_manager.event_timer_add(PERIOD, window=context.window)
        context.window_manager.modal_handler_add(self)
        redraw(context)
        return {"RUNNING_MODAL"}

    def load(self, job: jobs.Job):
        """Load what `change` needs, in its own thread: no Blender data here. None changes nothing."""
        return None

    def change(self, scene, loaded) -> Generator[float, None, tuple[str, ...]]:
        """Change the scene in slices; returns warnings."""
        yield 1.0
        return ()

    def modal(self, context, event):
        if self._timer is None:  # it has ended, and Blender calls once more for a window that it opened
            return {"FINISHED"}
        job = self.job
        if job is not jobs.current():  # another file was loaded
            return self._leave(context, {"CANCELLED"})
        stop = event.type == "ESC" and event.value == "PRESS" and over_3d_view(context, event)
        try:
            if job.facts["phase"] == "change":
                return self._apply_slice(context, event, stop)
            if stop:
                job.stop()
                job.facts["unwanted"] = True  # even if it finishes
                self._redraw_on_change(context)
                return {"RUNNING_MODAL"}
            if event.type == "TIMER":
                return self._poll_job(context) or {"PASS_THROUGH"}
        except ScanRelightError as error:
            return self._fail(context, str(error))
        except Exception as error:  # the last line of defence: a sentence, never a bare traceback
            return self._fail(context, unexpected(error, job.facts.get("result_folder")))
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """Blender cancels the operator: it quits, or the window is closed."""
        self.job.stop()
        self._leave(context, set())

    def tidy(self, job: jobs.Job) -> None:
        """Clean up what only this job needed; called at its end, however it ended."""

    def _poll_job(self, context):
        job = self.job
        self._redraw_on_change(context)
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
        if isinstance(self._loaded, Exception):
            raise self._loaded
        if self._loaded is None:
            return self._done(context, (), {"CANCELLED"})  # nothing has changed: no undo step
        if context.mode != "OBJECT":
            job.facts["phase"] = "wait"
            return None
        scene = next((item for item in bpy.data.scenes if item.session_uid == job.facts["scene"]), None)
        if scene is None:
            folder = job.facts.get("result_folder")
            return self._fail(
                context,
                "The scene that the run was started for is gone"
                + (f"; its result lies in '{folder}'." if folder else "."),
            )
        job.facts["phase"], job.facts["changed"] = "change", 0.0
        self._changes = self.change(scene, self._loaded)
        context.window_manager.event_timer_remove(self._timer)
        self._timer = context.window_manager.event_timer_add(CHANGE_PERIOD, window=context.window)
        return None

    def _load(self) -> None:
        try:
            self._loaded = self.load(self.job)
        except Exception as error:  # raised again in the main thread
            self._loaded = error

    def _apply_slice(self, context, event, stop: bool):
        """Change the scene for one slice; no other event reaches Blender until it is done."""
        if stop:
            self._changes.close()
            self.report({"WARNING"}, "Stopped while the result came in; undo takes back what has come.")
            return self._leave(context, {"FINISHED"})
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        deadline = time.monotonic() + SLICE
        while time.monotonic() < deadline:
            try:
                self.job.facts["changed"] = next(self._changes)
            except StopIteration as end:
                return self._done(context, end.value or (), {"FINISHED"})
        self._redraw_on_change(context)
        return {"RUNNING_MODAL"}

    def _done(self, context, warnings, status: set[str]):
        job = self.job
        job.warnings.extend(warning for warning in warnings if warning not in job.warnings)
        count = len(job.warnings)
        suffix = f"; {count} warning{'s' * (count > 1)}, see the panel" if count else ""
        self.report({"INFO"}, f"{self.bl_label}: done in {duration(job.seconds)}{suffix}.")
        return self._leave(context, status)

    def _fail(self, context, sentence: str):
        during_change = self.job.facts["phase"] == "change"
        self.job.facts["failed"] = sentence
        self.report({"ERROR"}, sentence)
        return self._leave(context, {"FINISHED"} if during_change else {"CANCELLED"})

    def _redraw_on_change(self, context) -> None:
        job = self.job
        text, now = bar(job)[1], time.monotonic()
        state = job.stage, job.state, job.stopping, job.facts["phase"]
        if text == self._last_text or (state == self._state and now - self._drawn_at < REDRAW):
            return
        self._last_text, self._state, self._drawn_at = text, state, now
        redraw(context)

    def _leave(self, context, status: set[str]) -> set[str]:
        self.job.facts["phase"] = "end"
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        self.tidy(self.job)
        redraw(context)
        return status


def bar(job: jobs.Job) -> tuple[float, str]:
    """Factor and text of the progress bar."""
    phase = job.facts.get("phase")
    if phase == "change":
        return job.facts["changed"], translated("Into the scene")
    if phase == "load":
        return 1.0, translated("Loading the result")
    if phase == "wait":
        return 1.0, translated("Done; leave the editing mode to bring it in")
    return job.overall, progress_text(job)


def active() -> jobs.Job | None:
    """The job whose operator has not ended yet, or None."""
    job = jobs.current()
    return job if job is not None and job.facts.get("phase") != "end" else None


@bpy.app.handlers.persistent
def forget_job(*_) -> None:
    """Another file is loaded: the run that was started for this one ends."""
    jobs.forget()
