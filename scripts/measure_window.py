"""Plays a run in Blender's window and writes what it costs the window: blender --python measure_window.py -- ...

The extension has to be installed and enabled. Events go to a file, one line of JSON each: `phase` whenever the run's
state changes, `stall` whenever the window's main loop stood still for a tenth of a second, `own` whenever a call of
this add-on's own code took more than 20 ms of it (wall and processor time). Play `idle` first: that is Blender's own.

    blender --python scripts/measure_window.py -- --capture DIR --result DIR --events FILE [--scenario NAME]

Scenarios: idle, run (a draft; press ESC over the 3D view at will), import, undo (edits, undo and redo while it runs),
load (another file while it runs), scene (its scene is removed), quit, disable (the add-on is switched off meanwhile).
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
import time

import bpy

TAB = "Scan Relight"
STALL, OWN = 0.1, 0.02
started = {"last": None, "phase": ""}


def main() -> None:
    """Read the options and wait for the window."""
    global options, events
    parser = argparse.ArgumentParser(prog="measure_window.py")
    parser.add_argument("--capture", required=True)
    parser.add_argument("--result", required=True)
    parser.add_argument("--events", required=True)
    parser.add_argument("--scenario", default="run")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    events = open(options.events, "w", encoding="utf-8")
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(begin, first_interval=0.5)


def tell(kind: str, **values: object) -> None:
    """Write an event."""
    events.write(json.dumps({"time": round(time.time(), 3), "kind": kind, **values}) + "\n")
    events.flush()


def module(name: str):
    """A module of the installed extension."""
    found = [full for full in sys.modules if full.endswith(f".scan_relight.{name}")]
    if not found:
        sys.exit("Scan Relight is not enabled in this Blender.")
    return sys.modules[found[0]]


def phase() -> str:
    """Where the run is: what its operator does, the job's state, the stage."""
    job = module("addon.bridge.job.job").current()
    return "none" if job is None else f"{job.facts.get('phase')}/{job.state}/{job.stage}"


def in_view() -> dict:
    """A context within the 3D view."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return {"window": window, "area": area, "region": next(one for one in area.regions if one.type == "WINDOW")}


def opened() -> bool:
    """Whether the sidebar shows our tab; opens it bit by bit, as Blender needs a drawing in between."""
    area = in_view()["area"]
    area.tag_redraw()
    if not area.spaces.active.show_region_ui:
        area.spaces.active.show_region_ui = True
        return False
    region = next(one for one in area.regions if one.type == "UI")
    if region.active_panel_category != TAB:
        region.active_panel_category = TAB
        return False
    return True


def timed(cls: type, name: str) -> None:
    """Have `cls.name` tell when it takes long. Blender counts arguments, so the wrapper has the same."""
    inner = getattr(cls, name)

    def note(function):
        wall, cpu = time.perf_counter(), time.thread_time()
        value = function()
        wall, cpu = time.perf_counter() - wall, time.thread_time() - cpu
        if wall > OWN:
            tell("own", what=f"{cls.__name__}.{name}", seconds=round(wall, 4), processor=round(cpu, 4), phase=phase())
        return value

    def draw(self, context):
        return note(lambda: inner(self, context))

    def modal(self, context, event):
        return note(lambda: inner(self, context, event))

    setattr(cls, name, {"draw": draw, "modal": modal}[name])


def watch() -> float:
    """Tell stalls and phases."""
    now = time.perf_counter()
    if started["last"] is not None and now - started["last"] > STALL:
        tell("stall", seconds=round(now - started["last"], 3), phase=phase())
    started["last"] = now
    if phase() != started["phase"]:
        started["phase"] = phase()
        tell("phase", phase=started["phase"])
    return 0.01


def begin() -> float | None:
    """Open the tab, choose, start."""
    if not opened():
        return 0.3
    timed(module("operators.base.job_operator").JobOperator, "modal")
    timed(module("operators.recover.panel_capture").SCAN_RELIGHT_PT_capture, "draw")
    timed(module("operators.recover.panel_recover").SCAN_RELIGHT_PT_recover, "draw")
    bpy.app.timers.register(watch, persistent=True)
    tell("begin", scenario=options.scenario, process=os.getpid())
    if options.scenario != "idle":
        choices = bpy.context.scene.scan_relight
        choices.capture_folder, choices.result_folder, choices.preset = options.capture, options.result, "draft"
        bpy.app.timers.register(start, first_interval=5.0)
    return None


def start() -> None:
    """Press Run, or Import."""
    target = "import_capture" if options.scenario == "import" else "recover"
    with bpy.context.temp_override(**in_view()):
        bpy.ops.scan_relight.run("INVOKE_DEFAULT", target=target)
    job = module("addon.bridge.job.job").current()
    tell("started", process=job.process_id if job else None)
    if options.scenario not in ("run", "import"):
        steps = itertools.count()
        bpy.app.timers.register(lambda: play(next(steps)), first_interval=2.0, persistent=True)


def play(step: int) -> float | None:
    """Do to the run what artists do."""
    with bpy.context.temp_override(**in_view()):
        if step < 3:
            bpy.ops.mesh.primitive_cube_add()
            bpy.ops.ed.undo_push(message="Cube")
        elif step < 6:
            bpy.ops.ed.undo()
        elif step == 6:
            bpy.ops.ed.redo()
            tell("undone", objects=len(bpy.data.objects))
        elif step == 8:
            tell("harmed", how=options.scenario)
            if options.scenario == "load":
                bpy.ops.wm.read_homefile()
            elif options.scenario == "scene":
                old = bpy.context.scene
                bpy.ops.scene.new(type="EMPTY")
                bpy.data.scenes.remove(old)
            elif options.scenario == "quit":
                bpy.ops.wm.quit_blender()
            elif options.scenario == "disable":
                name = module("operators.preferences").PACKAGE
                bpy.ops.preferences.addon_disable(module=name)
                return None
        elif step == 13:
            tell("still here")
            return None
    return 0.4


main()
