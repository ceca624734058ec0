"""What the operators share that correct recovered objects, and the refit that follows."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...addon.bridge.corrections import corrections, refitted
from ...addon.bridge.job import job as jobs
from ...addon.bridge.slices import whole
from ...addon.core.errors import ScanRelightError
from ..base import poll
from ..base.at_once import AtOnce, OneSentence
from ..base.job_operator import FOLLOWED, JobOperator
from ..results import told


def chosen(context) -> list[bpy.types.Object]:
    """The recovered objects that are selected; the active one, where it is none of those, alone."""
    active = context.view_layer.objects.active if context.view_layer else None
    found = [thing for thing in context.selected_objects if corrections.correctable(thing)]
    if corrections.correctable(active) and active not in found:
        return [active]
    return found


def on_selected(cls):
    """Class decorator: for what is said of the selected objects."""
    return poll.needs(chosen, "Select a recovered object first.")(poll.object_mode(poll.has_scene(cls)))


def in_room(cls):
    """Class decorator: for what is said of any object of the room."""
    any_there = poll.needs(
        lambda context: any(map(corrections.correctable, context.scene.objects)), "The scene holds no recovered object."
    )
    return any_there(poll.object_mode(poll.has_scene(cls)))


class CorrectOperator(AtOnce):
    """Changes recovered objects at once, in one undo step; `work` returns remarks."""

    remarks = "INFO"

    def act(self, context):
        return self.work(context, chosen(context))


@poll.no_run
class RefitOperator(OneSentence, JobOperator):
    """States something of the selected objects (`state`) and fits them again, all in one undo step."""

    bl_options = {"REGISTER", "UNDO"}
    always = False
    asks_for = ""
    """Property that is asked for where nobody gave it: from a menu or the search."""

    def invoke(self, context, event):
        if self.asks_for and not self.properties.is_property_set(self.asks_for):
            return context.window_manager.invoke_props_dialog(self)
        return self.execute(context)

    def state(self, context, things) -> list[bpy.types.Object]:
        """Say it; returns the objects that are to be fitted again."""
        return things

    def execute(self, context):
        """State it, then refit behind the window, or here in the background."""
        self._stated = False

        def work() -> set[str]:
            things = self.state(context, chosen(context))
            self._stated = True
            if not self.always and not context.scene.scan_relight_correct.refit_automatically:
                return {"FINISHED"}
            return self.refit(context, things)

        return self._verdict(self.attempt(work))

    def refit(self, context, things):
        from ...addon.bridge.job.command import command

        folder, words, before = refitted.words(context.scene, things)
        facts = {"title": self.bl_label, "result_folder": str(folder), "before": before}
        if not bpy.app.background:
            return self.start(context, command(words, **FOLLOWED), **facts)
        job = jobs.begin(command(words, **FOLLOWED), phase="run", **facts)
        job.wait()
        job.facts["phase"] = "end"
        if job.state != jobs.DONE:
            raise ScanRelightError(job.sentence)
        for sentence in (*job.warnings, *whole(self.change(context.scene, self.load(job)))):
            self.report({"WARNING"}, sentence)
        return {"FINISHED"}

    def load(self, job):
        folder = Path(job.facts["result_folder"])
        return folder, job.facts["before"], refitted.fitted(folder)

    def change(self, scene, loaded):
        warnings = yield from refitted.bringing(scene, *loaded)
        told.forget()
        return warnings

    def _leave(self, context, verdict):
        return super()._leave(context, self._verdict(verdict))

    def _verdict(self, verdict):
        """What was stated stays, and is an undo step, also where the refit was stopped or failed."""
        return {"FINISHED"} if verdict == {"CANCELLED"} and self._stated and not self.always else verdict
