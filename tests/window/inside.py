"""Runs inside the Blender that is tested: answers what the tests ask, finds buttons, notes when the window stood still.

    blender --python inside.py -- FOLDER

A question is a file `ask-N.py` in FOLDER: an expression, or statements that leave their result in `answer`. The answer
is `answer-N.json`. A question whose value is a generator goes on in the next ticks, until it returns.
"""

import json
import os
import signal
import sys
import time
import traceback
from pathlib import Path

import bpy

TAB = "Scan Relight"
STALL = 0.1
WHEEL = 40
"""Pixels of one turn of the mouse's wheel."""
FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
state = {"next": 0, "task": None, "last": None, "stalls": [], "own": [], "phases": [], "watching": False, "known": {}}


def module(name):
    """A module of the installed extension."""
    return next(one for full, one in sys.modules.items() if full.endswith(f".scan_relight.{name}"))


def place(kind="WINDOW"):
    """A context in the 3D view: in its region of this kind."""
    window = bpy.context.window_manager.windows[0]
    area = next(one for one in window.screen.areas if one.type == "VIEW_3D")
    return {
        "window": window,
        "screen": window.screen,
        "area": area,
        "region": next(one for one in area.regions if one.type == kind),
    }


def rectangle(kind="WINDOW"):
    """Left, top, width, height of a region of the 3D view, from the window's upper left corner."""
    region, window = place(kind)["region"], bpy.context.window_manager.windows[0]
    return region.x, window.height - region.y - region.height, region.width, region.height


def open_tab():
    """Open the sidebar at our tab; Blender needs a drawing between the steps."""
    where = place("UI")
    for _ in range(100):
        space, region = where["area"].spaces.active, where["region"]
        if not space.show_region_ui:
            space.show_region_ui = True
        elif region.active_panel_category != TAB:
            try:
                region.active_panel_category = TAB
            except TypeError:  # not drawn yet
                pass
        else:
            return region.active_panel_category
        where["area"].tag_redraw()
        yield
        where = place("UI")
    return where["region"].active_panel_category


def under_mouse():
    """What the button under the mouse does or shows, as Blender writes it in Python; '' where there is none."""
    manager = bpy.context.window_manager
    manager.clipboard = ""
    with bpy.context.temp_override(**place("UI")):
        for copy in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
            if copy.poll():
                try:
                    copy()
                except RuntimeError:
                    continue
                return manager.clipboard
    return ""


def scroll(pixels):
    """Move the sidebar's content up, by steps of what one turn of the wheel moves: Blender heeds no other amount."""
    step = bpy.ops.view2d.scroll_down if pixels > 0 else bpy.ops.view2d.scroll_up
    where = place("UI")
    with bpy.context.temp_override(**where):
        for _ in range(int(abs(pixels) // WHEEL)):
            before = where["region"].view2d.region_to_view(0, 0)
            step()
            if where["region"].view2d.region_to_view(0, 0) == before:
                break


def find(words, across=(0.5, 0.25, 0.75, 0.12, 0.9), top=True):
    """Look for a button by moving the mouse over the sidebar, page by page.

    Returns x and y, from the window's upper left corner, where its text holds all `words`; else all that was found.
    Without `top` the search begins where the sidebar is scrolled to, and goes on from its top.
    """
    window, seen = bpy.context.window_manager.windows[0], {}
    for text, (x, y) in list(state["known"].items()):  # where it was seen before
        if all(word in text for word in words):
            window.cursor_warp(x, window.height - y)
            for _ in range(3):
                yield
            if under_mouse() == text:
                return [x, y]
    for whole in (False, True) if not top else (True,):
        if whole:
            scroll(-100000)
            yield
        for _ in range(12):
            place_ = yield from look_over(words, across, seen)
            if place_:
                state["known"].update(seen)
                return place_
            if not (yield from next_page()):
                break
    return {"seen": sorted(text for text in seen if text)}


def look_over(words, across, seen):
    """`find` on what the sidebar shows at the moment."""
    window, region = bpy.context.window_manager.windows[0], place("UI")["region"]
    for share in across:
        x = region.x + round((region.width - 40) * share) + 8
        for y in range(region.y + region.height - 16, region.y + 6, -15):
            window.cursor_warp(x, y)
            yield
            yield
            text = under_mouse()
            seen[text] = (x, window.height - y)
            if text and all(word in text for word in words):
                for _ in range(2):
                    yield
                if under_mouse() == text:  # still there after what the mouse had Blender draw
                    return list(seen[text])
    return None


def next_page():
    """Scroll the sidebar on; whether there was anything to scroll to."""
    for _ in range(3):
        where = place("UI")
        where["area"].tag_redraw()  # scrolling alone lays nothing out anew, and Blender stops at the old end
        for _ in range(5):
            yield
        region = place("UI")["region"]
        before = region.view2d.region_to_view(0, 0)
        scroll(region.height * 0.6)
        for _ in range(3):
            yield
        if place("UI")["region"].view2d.region_to_view(0, 0) != before:
            return True
    return False


def phase():
    """What the run does: its operator's part, its state, its stage."""
    job = module("addon.bridge.job.job").current()
    return "none" if job is None else f"{job.facts.get('phase')}/{job.state}/{job.stage}"


def pause_in(stage):
    """Wait for a stage of the run, and have its process stand still there until it is sent SIGCONT."""
    for _ in range(3000):
        job = module("addon.bridge.job.job").current()
        if job is not None and job.running and job.stage == stage:
            os.kill(job._process.pid, signal.SIGSTOP)
            return job.stage
        yield
    raise RuntimeError(f"the run never came to {stage}: {phase()}")


def watch_own_code():
    """From now on note how long each call of the add-on's own code takes the window's thread."""
    state.update(watching=True, stalls=[], own=[], phases=[])
    if state.get("wrapped"):
        return
    state["wrapped"] = True
    kinds = [cls for name in dir(bpy.types) if name.startswith("SCAN_RELIGHT_") for cls in [getattr(bpy.types, name)]]
    owners = {
        id(vars(owner)[name]): (owner, name)
        for cls in kinds
        for owner in cls.__mro__
        for name in ("draw", "modal", "execute", "invoke", "poll")
        if name in vars(owner) and getattr(owner, "__module__", "").find("scan_relight") >= 0
    }
    for owner, name in owners.values():
        if not isinstance(vars(owner)[name], classmethod):
            wrap(owner, name)


def wrap(owner, name):
    """Have a method tell its time; Blender counts arguments, so the wrapper has as many."""
    inner = vars(owner)[name]

    def note(call):
        wall, cpu = time.perf_counter(), time.thread_time()
        try:
            return call()
        finally:
            state["own"].append(
                (f"{owner.__name__}.{name}", time.perf_counter() - wall, time.thread_time() - cpu, phase())
            )

    def two(self, context):
        return note(lambda: inner(self, context))

    def three(self, context, event):
        return note(lambda: inner(self, context, event))

    setattr(owner, name, three if name in ("modal", "invoke") else two)


def watched():
    """What was noted: stalls of the window, the longest calls of our own code, the run's phases with their times."""
    longest = {}
    for name, wall, cpu, when in state["own"]:
        if cpu > longest.get(name, {"processor": -1.0})["processor"]:
            longest[name] = {"seconds": round(wall, 4), "processor": round(cpu, 4), "phase": when}
    return {"stalls": state["stalls"], "own": longest, "calls": len(state["own"]), "phases": state["phases"]}


def tick():
    """Look for the next question, or go on with the one that takes longer."""
    now = time.perf_counter()
    if state["watching"]:
        if state["last"] is not None and now - state["last"] > STALL:
            state["stalls"].append(round(now - state["last"], 3))
        if not state["phases"] or state["phases"][-1][1] != phase():
            state["phases"].append((time.time(), phase()))
    state["last"] = now
    question = FOLDER / f"ask-{state['next']}.py"
    if state["task"] is None and question.exists():
        answer(lambda: evaluate(question.read_text(encoding="utf-8")))
    elif state["task"] is not None:
        answer(lambda: state["task"])
    return 0.02


def evaluate(code):
    """An expression's value, or what statements leave in `answer`."""
    names = dict(globals(), answer=None)
    try:
        compiled = compile(code, "ask", "eval")
    except SyntaxError:
        exec(compile(code, "ask", "exec"), names)
        return names["answer"]
    return eval(compiled, names)


def answer(get):
    """Write the answer once it is there."""
    try:
        value = get()
        if hasattr(value, "send"):
            state["task"] = value
            try:
                next(value)
                return
            except StopIteration as end:
                value = end.value
        told = {"value": value}
        text = json.dumps(told, default=str)
    except Exception:
        text = json.dumps({"error": traceback.format_exc()})
    state["task"] = None
    part = FOLDER / "part"
    part.write_text(text, encoding="utf-8")
    number, state["next"] = state["next"], state["next"] + 1
    part.rename(FOLDER / f"answer-{number}.json")


bpy.context.preferences.view.show_splash = False
bpy.context.preferences.filepaths.use_auto_save_temporary_files = False
bpy.app.timers.register(tick, first_interval=0.2, persistent=True)
