"""What was found in captures, by folder and way of reading. Kept while Blender runs, never in the file."""

import json
import time

import bpy

from ...addon.bridge.job import job as jobs
from ...addon.bridge.job.command import command
from ...addon.core.io.folder import CAPTURE, Content, look_into
from ...addon.core.kinds import Shown
from ..base.job_operator import redraw
from . import reading_props

_found: dict[tuple, jobs.Job | dict | str] = {}
FRESH: Shown[float] = 2.0
"""Seconds for which what a folder is stays known: panels are drawn often, disks are slow."""
_contents: dict[str, tuple[float, Content]] = {}


def key(choices) -> tuple:
    """What a finding is found by: the capture's folder and how it is read."""
    return bpy.path.abspath(choices.capture_folder), *reading_props.options(choices.reading)


def wrong_folder(choices) -> Content | None:
    """What the chosen folder is where it is no capture; None where it is one, was read, or its format was given."""
    if not choices.capture_folder or choices.reading.reading_format != reading_props.FOUND:
        return None
    if isinstance(_found.get(key(choices)), dict):
        return None
    folder = bpy.path.abspath(choices.capture_folder)
    read, content = _contents.get(folder, (0.0, None))
    if content is None or time.monotonic() - read > FRESH:
        content = look_into(folder)
        _contents.clear()  # of one folder at a time
        _contents[folder] = time.monotonic(), content
    return None if content.kind == CAPTURE else content


def look(choices) -> jobs.Job | dict | str | None:
    """A job that still reads, the facts as `describe` gives them, a sentence on what is wrong, or None."""
    found = _found.get(key(choices))
    if isinstance(found, jobs.Job) and not found.running:
        found = _found[key(choices)] = _result(found)
    return found


def put(choices, found: dict | str) -> None:
    """Keep what was found."""
    _found[key(choices)] = found


def begin(choices) -> None:
    """Read the capture beside the window; a panel shows what was found once it is there."""
    for one in _found.values():
        if isinstance(one, jobs.Job):
            one.stop()  # the folder before: nobody waits for it any more
    folder, *options = key(choices)
    found = _found[key(choices)] = jobs.Job(command(["info", folder, *options], json=True, stop_with_stdin=True))

    def watch():
        if found.running:
            return 0.2
        redraw(bpy.context)
        return None

    bpy.app.timers.register(watch, first_interval=0.2)


def facts(job: jobs.Job) -> dict:
    """What a job that runs `info --json` said; raises ValueError where that is no JSON."""
    return json.loads(job.text[job.text.index("{") :])


def _result(job: jobs.Job) -> dict | str:
    if job.state == jobs.DONE:
        try:
            return facts(job)
        except ValueError:
            return "The capture was read, but what was found can't be understood; start Blender anew."
    return job.sentence if job.state == jobs.FAILED else "The check was stopped; check again."


def forget() -> None:
    """Know nothing any more."""
    for one in _found.values():
        if isinstance(one, jobs.Job):
            one.stop()
    _found.clear()
    _contents.clear()
