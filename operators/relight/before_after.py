"""`bpy.ops.scan_relight.before_after`: one view under captured and new light, side by side."""

# No `from __future__ import annotations` here: Blender reads the properties off the annotations.
import os
import shutil
import tempfile
from pathlib import Path

import bpy

from ...addon.bridge.relight import before_after, pictures
from ...addon.bridge.render_device import told_device
from ..base import poll
from ..base.job_operator import FOLLOWED, JobOperator
from .base import RelightOperator
from .props import ENGINE, PERCENTAGE, SAMPLES

FILE = "before_after.png"


@poll.no_run
@poll.needs(
    lambda context: context.scene.camera is not None, "The scene has no camera to render through; choose a frame first."
)
class SCAN_RELIGHT_OT_before_after(JobOperator, RelightOperator, bpy.types.Operator):
    """Render this view under the captured and the present light, side by side, into an image and a file"""

    bl_idname = "scan_relight.before_after"
    bl_label = "Before and After"
    bl_options = {"UNDO"}

    filepath: bpy.props.StringProperty(
        name="File",
        description="Picture to write; by default before_after.png in the room's result folder",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    engine: ENGINE
    samples: SAMPLES
    percentage: PERCENTAGE

    def target(self, scene) -> Path:
        """The file to write."""
        if self.filepath:
            return Path(bpy.path.abspath(self.filepath)).absolute()
        folder, stays = before_after.picture_folder(scene, scene.scan_relight.result_folder)
        if not stays:
            self.report({"INFO"}, "The picture goes with this session: there is no result folder to keep it in.")
        return folder / FILE

    def work(self, context):
        scene, out = context.scene, self.target(context.scene)
        with pictures.settings_kept(scene):
            pictures.prepare(scene, self.engine, self.samples, self.percentage)
            before_after.render_pair(scene, out)
        before_after.show(out)

    def execute(self, context):
        """Blocks in the background; else starts the job."""
        if bpy.app.background:
            return RelightOperator.execute(self, context)
        return self.attempt(lambda: self.begin(context))

    def begin(self, context) -> set[str]:
        """Start the job."""
        from ...addon.bridge.job.command import command

        out = self.target(context.scene)
        pictures.check_format(out)
        self._folder = Path(tempfile.mkdtemp(prefix="scan_relight_"))
        before_after.save_copy(self._folder)
        words = command(
            ["relight", self._folder],
            out=self._folder / out.name,
            before_after=True,
            engine=self.engine.lower(),
            samples=self.samples,
            size=self.percentage,
            device=told_device(context.scene),
            scene=context.scene.name,
            **FOLLOWED,
        )
        return self.start(context, words, title="Before and After", out=str(out), result_folder="")

    def load(self, job):
        out = Path(job.facts["out"])
        out.parent.mkdir(parents=True, exist_ok=True)
        with pictures.saving(out) as temporary:
            shutil.copyfile(self._folder / out.name, temporary)
        return out

    def change(self, scene, loaded):
        before_after.show_in_window(before_after.show(loaded))
        yield 1.0
        return ()

    def _leave(self, context, verdict):
        shutil.rmtree(getattr(self, "_folder", os.devnull), ignore_errors=True)
        return super()._leave(context, verdict)
