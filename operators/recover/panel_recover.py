"""The tab's second part: settings, the run and its progress."""

import bpy

from ...addon.bridge.custom_properties import OWN_SCENE
from ...addon.bridge.job import job as jobs
from ...addon.bridge.results import changes as room_changes
from ...addon.bridge.results import default_folders, images
from ...addon.console import duration
from ...addon.core.kinds import Shown
from ...addon.core.results.unfinished import goes_on_with
from ...addon.core.stages import LABELS, STAGES
from ...addon.settings_info import setting_infos
from .. import preferences
from ..base.job_operator import active, bar
from ..base.panel import SidebarPanel, fields, folded
from . import findings

GROUPS = (
    ("Capture", ("denoise_mesh", "refine_poses")),
    ("Texture", ("texel_size", "detail", "atlas_size", "atlas", "median", "sharpen", "texture_fill")),
    ("Light", ("shading", "shading_rays", "emitter_rays", "portal_rays", "interpolate", "mirrors")),
    ("Highlights", ("specular", "specular_rays", "refine")),
    ("Computer", ("threads", "seed")),
)
OTHER = "More"
CHANGES: Shown[int] = 8
"""Maximum number of objects that are listed as changed since the previous run."""


def groups() -> list[tuple[str, list[str]]]:
    """Every setting under its heading; those without one come last."""
    names = [info.name for info in setting_infos()]
    placed = {name for _, group in GROUPS for name in group}
    grouped = [(heading, [name for name in group if name in names]) for heading, group in GROUPS]
    return [*grouped, (OTHER, [name for name in names if name not in placed])]


class SCAN_RELIGHT_PT_recover(SidebarPanel, bpy.types.Panel):
    """Run the recovery."""

    bl_label = "Recover"
    manual = "panel#recover"
    bl_order = 1

    def draw(self, context):
        job = active()
        choices = self.layout.column()
        choices.enabled = job is None
        self.choices(choices, context)
        if job is None:
            self.start(context)
            self.outcome()
            self.room(context)
        else:
            self.progress(job)

    def choices(self, layout, context) -> None:
        choices = context.scene.scan_relight
        fields(layout, choices, "preset")
        fields(layout, choices.settings, "detail", "shading_rays")
        layout.prop(choices, "result_folder")
        if not choices.result_folder and choices.capture_folder:
            self.say(
                layout,
                f"Goes into '{default_folders.display_path(preferences.chosen_result(context.scene))}'.",
                "FILE_FOLDER",
            )
        layout.prop(choices, "images")
        if choices.images == images.FOLDER and not bpy.data.filepath:
            self.say(layout, images.NEVER_SAVED, "ERROR")
        changed = choices.settings.changed(choices.preset)
        if body := folded(layout, "settings", "Settings" + (f" ({len(changed)} changed)" if changed else "")):
            for heading, names in groups():
                if names:
                    column = body.column()
                    column.label(text=heading)
                    fields(column, choices.settings, *names)

    def start(self, context) -> None:
        """The button; where a run was stopped, it resumes, and there is another one to start again."""
        choices = context.scene.scan_relight
        folder = preferences.chosen_result(context.scene)
        stage = goes_on_with(folder) if folder is not None else ""
        row = self.layout.row()
        row.scale_y = 1.4
        row.enabled = findings.wrong_folder(choices) is None
        row.operator("scan_relight.run", text="Resume" if stage else "Run", icon="PLAY").target = "recover"
        if stage:
            self.say(
                self.layout,
                f"Goes on with: {LABELS[stage]}. What is finished is kept, where its settings are the same.",
            )
            button = self.layout.operator("scan_relight.run", text="Start Anew", icon="FILE_REFRESH")
            button.target, button.from_stage = "recover", STAGES[0]

    def progress(self, job: jobs.Job) -> None:
        factor, text = bar(job)
        column = self.layout.column(align=True)
        if job.facts.get("title") not in (None, "", "Recover Capture"):  # no heading twice
            column.label(text=job.facts["title"])
        column.progress(factor=factor, text=text)
        column.operator("scan_relight.stop", text="Stop", icon="CANCEL")

    def room(self, context) -> None:
        """Changes since the previous run, and the button to link the room into another scene."""
        scene, layout = context.scene, self.layout
        if not scene.get(OWN_SCENE):
            return
        changes = room_changes.stored_changes(scene)
        if changes and (body := folded(layout, "changes", f"{len(changes)} objects differ from the run before")):
            for change in changes[:CHANGES]:
                self.say(body, change["text"], "DOT")
        if len(bpy.data.scenes) > 1:
            layout.operator_menu_enum("scan_relight.link_room", "scene", icon="LINKED")

    def outcome(self) -> None:
        """How the last run of this session ended."""
        job = jobs.current()
        if job is None or job.running:
            return
        layout = self.layout
        failed = job.facts.get("failed") or (job.sentence if job.state != jobs.DONE else "")
        if failed:
            self.say(layout, failed, "INFO" if job.state == jobs.STOPPED else "CANCEL")
        elif job.facts.get("unwanted"):
            self.say(layout, jobs.STOPPED_TEXT, "INFO")
        else:
            self.say(layout, f"{job.facts.get('title', 'Run')}: done in {duration(job.seconds)}.", "CHECKMARK")
        count = len(job.warnings)
        if count and (body := folded(layout, "warnings", f"{count} warning{'s' * (count > 1)}")):
            for sentence in job.warnings:
                self.say(body, sentence, "ERROR")
