"""Findings of captures, by folder and reading options. Kept in memory, never in the file."""

import json
import time

import bpy

from ...addon.bridge.job import job as jobs
from ...addon.bridge.job.command import command
from ...addon.core.io.folder import CAPTURE, Content, look_into
from ...addon.core.kinds import Shown
from ..base.job_operator import redraw
from . import reading_props

_findings: dict[tuple, jobs.Job | dict | str] = {}
CACHE_SECONDS: Shown[float] = 2.0
"""Seconds for which the content of a folder is cached: panels are drawn often, disks are slow."""
_contents: dict[str, tuple[float, Content]] = {}


def key(choices) -> tuple:
    """Key of a finding: the capture's folder and reading options."""
    return bpy.path.abspath(choices.capture_folder), *reading_props.options(choices.reading)


def wrong_folder(choices) -> Content | None:
    """Content of the chosen folder if it is no capture; None where it is one, was read, or its format was given."""
    if not choices.capture_folder or choices.reading.reading_format != reading_props.FOUND:
        return None
    if isinstance(_findings.get(key(choices)), dict):
        return None
    folder = bpy.path.abspath(choices.capture_folder)
    read_at, content = _contents.get(folder, (0.0, None))
    if content is None or time.monotonic() - read_at > CACHE_SECONDS:
        content = look_into(folder)
        _contents.clear()  # one folder at a time
        _contents[folder] = time.monotonic(), content
    return None if content.kind == CAPTURE else content


def look(choices) -> jobs.Job | dict | str | None:
    """A job that is still reading, the facts of `describe`, an error sentence, or None."""
    finding = _findings.get(key(choices))
    if isinstance(finding, jobs.Job) and not finding.running:
        finding = _findings[key(choices)] = _result(finding)
    return finding


def put(choices, finding: dict | str) -> None:
    """Store a finding."""
    _findings[key(choices)] = finding


def begin(choices) -> None:
    """Read the capture beside the window; a panel shows the finding once there is one."""
    for finding in _findings.values():
        if isinstance(finding, jobs.Job):
            finding.stop()  # of the previous folder: no longer needed
    folder, *options = key(choices)
    job = _findings[key(choices)] = jobs.Job(command(["info", folder, *options], json=True, stop_with_stdin=True))

    def watch():
        if job.running:
            return 0.2
        redraw(bpy.context)
        return None

    bpy.app.timers.register(watch, first_interval=0.2)


def facts(job: jobs.Job) -> dict:
    """The output of a job that runs `info --json`; raises ValueError where that is no JSON."""
    return json.loads(job.text[job.text.index("{") :])


def _result(job: jobs.Job) -> dict | str:
    if job.state == jobs.DONE:
        try:
            return facts(job)
        except ValueError:
            return "The capture was read, but what was found can't be understood; start Blender anew."
    return job.sentence if job.state == jobs.FAILED else "The check was stopped; check again."


def forget() -> None:
    """Clear all findings."""
    for finding in _findings.values():
        if isinstance(finding, jobs.Job):
            finding.stop()
    _findings.clear()
    _contents.clear()
