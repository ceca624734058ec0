"""The tab's second part: settings, the run and its progress."""

from __future__ import annotations

import bpy

from ...addon.bridge.job import job as jobs
from ...addon.bridge.marks import OWN_SCENE
from ...addon.bridge.results import changes as room_changes
from ...addon.bridge.results import home, images
from ...addon.console import duration
from ...addon.core.kinds import Shown
from ...addon.core.results.unfinished import goes_on_with
from ...addon.core.stages import LABELS, STAGES
from ...addon.settings_info import setting_infos
from .. import preferences
from ..base.job_operator import active, bar
from ..base.panel import SidebarPanel
from . import findings

GROUPS = (
    ("Capture", ("denoise_mesh", "refine_poses")),
    ("Texture", ("texel_size", "detail", "atlas_size", "atlas", "median", "sharpen")),
    ("Light", ("shading", "shading_rays", "emitter_rays", "portal_rays", "interpolate", "mirrors")),
    ("Highlights", ("specular", "specular_rays", "refine")),
    ("Computer", ("threads", "seed")),
)
OTHER = "More"
CHANGES: Shown[int] = 8
"""Objects that are listed as different since the run before."""


def groups() -> list[tuple[str, list[str]]]:
    """Every setting under its heading; one that has none comes last."""
    names = [info.name for info in setting_infos()]
    placed = {name for _, some in GROUPS for name in some}
    found = [(heading, [name for name in some if name in names]) for heading, some in GROUPS]
    return [*found, (OTHER, [name for name in names if name not in placed])]


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
            self.outcome(context)
            self.room(context)
        else:
            self.progress(job)

    def choices(self, layout, context) -> None:
        """Preset, folder, settings."""
        choices = context.scene.scan_relight
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(choices, "preset")
        changed = choices.settings.changed(choices.preset)
        layout.prop(choices.settings, "detail")
        layout.prop(choices.settings, "shading_rays")
        layout.prop(choices, "result_folder")
        if not choices.result_folder and choices.capture_folder:
            folder = preferences.result_folder("", choices.capture_folder, context.scene)
            self.say(layout, f"Goes into '{home.shown(folder)}'.", "FILE_FOLDER")
        layout.prop(choices, "images")
        if choices.images == images.FOLDER and not bpy.data.filepath:
            self.say(layout, images.NEVER_SAVED, "ERROR")
        header, body = layout.panel("scan_relight_settings", default_closed=True)
        header.label(text="Settings" + (f" ({len(changed)} changed)" if changed else ""))
        if body is not None:
            for heading, names in groups():
                if names:
                    column = body.column()
                    column.label(text=heading)
                    for name in names:
                        column.prop(choices.settings, name)

    def start(self, context) -> None:
        """The button; where a run was stopped, it goes on, and there is another to start anew."""
        choices = context.scene.scan_relight
        stage = (
            goes_on_with(preferences.result_folder(choices.result_folder, choices.capture_folder, context.scene))
            if choices.capture_folder
            else ""
        )
        row = self.layout.row()
        row.scale_y = 1.4
        row.enabled = findings.wrong_folder(choices) is None
        row.operator("scan_relight.run", text="Resume" if stage else "Run", icon="PLAY").target = "recover"
        if stage:
            self.say(
                self.layout,
                f"Goes on with: {LABELS[stage]}. What is finished is kept, where its settings are the same.",
            )
            again = self.layout.operator("scan_relight.run", text="Start Anew", icon="FILE_REFRESH")
            again.target, again.from_stage = "recover", STAGES[0]

    def progress(self, job: jobs.Job) -> None:
        """One bar, and Stop."""
        factor, text = bar(job)
        column = self.layout.column(align=True)
        if job.facts.get("title") not in (None, "", "Recover Capture"):  # no heading twice
            column.label(text=job.facts["title"])
        column.progress(factor=factor, text=text)
        column.operator("scan_relight.stop", text="Stop", icon="CANCEL")

    def room(self, context) -> None:
        """What differs since the run before, and the way into the artist's own scene."""
        scene, layout = context.scene, self.layout
        if not scene.get(OWN_SCENE):
            return
        changes = room_changes.shown(scene)
        if changes:
            header, body = layout.panel("scan_relight_changes", default_closed=True)
            header.label(text=f"{len(changes)} objects differ from the run before")
            if body is not None:
                for one in changes[:CHANGES]:
                    self.say(body, one["text"], "DOT")
        if len(bpy.data.scenes) > 1:
            layout.operator_menu_enum("scan_relight.link_room", "scene", icon="LINKED")

    def outcome(self, context) -> None:
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
        if job.warnings:
            header, body = layout.panel("scan_relight_warnings", default_closed=True)
            header.label(text=f"{len(job.warnings)} warning{'s' * (len(job.warnings) > 1)}")
            if body is not None:
                for sentence in job.warnings:
                    self.say(body, sentence, "ERROR")
