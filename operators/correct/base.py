"""What the operators share that correct recovered objects, and the refit that follows."""

from __future__ import annotations

import bpy

from ...addon.bridge.corrections import corrections, refitted
from ...addon.bridge.job import job as jobs
from ..base import poll
from ..base.at_once import AtOnce, OneSentence
from ..base.job_operator import JobOperator
from ..results import told


def chosen(context) -> list[bpy.types.Object]:
    """The recovered objects that are selected; the active one, where it is none of those, alone."""
    active = context.view_layer.objects.active if context.view_layer else None
    found = [thing for thing in context.selected_objects if corrections.correctable(thing)]
    if corrections.correctable(active) and active not in found:
        return [active]
    return found


class CorrectOperator(AtOnce):
    """Changes recovered objects at once, in one undo step; `work` returns remarks."""

    bl_options = {"REGISTER", "UNDO"}
    remarks = "INFO"

    @classmethod
    def poll(cls, context):
        """Only with a recovered object selected."""
        return (
            poll.has_scene(cls, context)
            and poll.object_mode(cls, context)
            and poll.check(cls, bool(chosen(context)), "Select a recovered object first.")
        )

    def act(self, context):
        """On what is selected."""
        return self.work(context, chosen(context))


class RefitOperator(OneSentence, JobOperator):
    """States something of the selected objects (`state`) and fits them again, all in one undo step."""

    bl_options = {"REGISTER", "UNDO"}
    always = False
    asks_for = ""
    """Property that is asked for where nobody gave it: from a menu or the search."""

    @classmethod
    def poll(cls, context):
        """Only with a recovered object, and no other run."""
        return CorrectOperator.poll.__func__(cls, context) and poll.no_run(cls)

    def invoke(self, context, event):
        """Ask for what is missing."""
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
        """Fit `things` again; what `execute` returns."""
        from ...addon.bridge.job.command import command

        folder, words, before = refitted.words(context.scene, things)
        facts = {"title": self.bl_label, "result_folder": str(folder), "before": before}
        if not bpy.app.background:
            return self.start(context, command(words), **facts)
        job = jobs.begin(command(words), phase="run", **facts)
        job.wait()
        job.facts["phase"] = "end"
        if job.state != jobs.DONE:
            self.report({"ERROR"}, job.sentence)
            return {"CANCELLED"}
        slices = self.change(context.scene, self.load(job))
        while True:
            try:
                next(slices)
            except StopIteration as end:
                for sentence in (*job.warnings, *end.value):
                    self.report({"WARNING"}, sentence)
                return {"FINISHED"}

    def load(self, job):
        """What the refit has left."""
        from pathlib import Path

        folder = Path(job.facts["result_folder"])
        return folder, job.facts["before"], refitted.fitted(folder)

    def change(self, scene, loaded):
        """Put it onto the objects."""
        warnings = yield from refitted.bringing(scene, *loaded)
        told.forget()
        return warnings

    def _leave(self, context, verdict):
        return super()._leave(context, self._verdict(verdict))

    def _verdict(self, verdict):
        """What was stated stays, and is an undo step, also where the refit was stopped or failed."""
        return {"FINISHED"} if verdict == {"CANCELLED"} and self._stated and not self.always else verdict
