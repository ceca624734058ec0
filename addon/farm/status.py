"""Progress of rooms, from the marks and locks in their result folders; reads no capture and no clock."""

import html
import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..core.io.files import json_if_sound
from ..core.io.folder import REPORT
from ..core.results.lock import owner
from ..core.stages import LABELS, RUN_STAGES, WRITE
from .plan import FOLDER
from .unit import stored_key

DONE, FAILED, RUNNING, WAITING, UNKNOWN = "done", "failed", "running", "waiting", "no plan"
COST = {"surface": 5, "lit_diffuse": 8, "shading": 17, "specular": 16, WRITE: 5}
"""Rough cost of the stages, as `pipeline.run.WEIGHTS`, which takes NumPy."""
PAGE = "report.html"


@dataclass(frozen=True)
class UnitState:
    """A unit of work: name, state, the machine that does it or did, time, memory and error."""

    name: str
    stage: str
    state: str
    machine: str = ""
    seconds: float = 0.0
    memory: int = 0
    error: str = ""


@dataclass(frozen=True)
class RoomState:
    """A room: result folder, state, current stage, share that is done, and units."""

    result: Path
    state: str
    stage: str
    share: float
    error: str
    units: tuple[UnitState, ...]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        units = [vars(unit) for unit in self.units]
        entry = {"room": self.result.name, "result": str(self.result), "state": self.state, "stage": self.stage}
        return entry | {"share": round(self.share, 4), "error": self.error, "units": units}


def room_state(result: Path) -> RoomState:
    """The progress of a room; a folder without a plan is no error."""
    try:
        plan = json.loads((result / FOLDER / "plan.json").read_text(encoding="utf-8"))
        task_names = [(str(task["name"]), str(task["stage"])) for task in plan["tasks"]]
    except FileNotFoundError:
        task_names = [(stage, stage) for stage in RUN_STAGES] if (result / FOLDER).is_dir() else []
    except (OSError, ValueError, KeyError, TypeError) as error:
        message = f"Its plan can't be read ({type(error).__name__}); submit it again."
        return RoomState(result, FAILED, "", 0.0, message, ())
    if not task_names:
        done = (result / REPORT).is_file()  # by one machine
        return RoomState(result, DONE if done else UNKNOWN, "", float(done), "", ())
    units = [_unit(result, name, stage) for name, stage in task_names]
    # What was joined needs its blocks no more.
    joined = {unit.stage for unit in units if unit.name == unit.stage and unit.state == DONE}
    units = [replace(unit, state=DONE) if unit.stage in joined else unit for unit in units]
    cost = [COST.get(unit.stage, 1) / sum(sibling.stage == unit.stage for sibling in units) for unit in units]
    share = sum(c for c, unit in zip(cost, units, strict=True) if unit.state == DONE) / sum(cost)
    unfinished = [unit for unit in units if unit.state != DONE]
    state = next((s for s in (RUNNING, FAILED, WAITING) if any(unit.state == s for unit in unfinished)), DONE)
    stage = next((unit.stage for unit in unfinished if unit.state == state), "")
    error = next((unit.error for unit in unfinished if unit.state == FAILED), "")
    return RoomState(result, state, stage, share, error, tuple(units))


def _unit(result: Path, name: str, stage: str) -> UnitState:
    mark = json_if_sound(result / FOLDER / f"{name}.json")
    holder, error = owner(result / FOLDER / f"{name}.lock"), str(mark.get("error", ""))
    if holder:
        return UnitState(name, stage, RUNNING, holder)
    if error:
        return UnitState(name, stage, FAILED, str(mark.get("machine", "")), error=error)
    # A mark tells of what is there: stages may be cleared, or done anew.
    stored = (result / REPORT).is_file() if stage == WRITE else mark.get("key") and stored_key(result, name)
    if not mark or not stored or (stage != WRITE and mark["key"] != stored):
        return UnitState(name, stage, WAITING)
    seconds, memory = float(mark.get("seconds", 0)), int(mark.get("peak_memory_bytes", 0))
    return UnitState(name, stage, DONE, str(mark.get("machine", "")), seconds, memory)


def table(rooms: list[RoomState]) -> str:
    """The rooms as lines of text."""
    rows = [("room", "state", "stage", "done", "")]
    rows += [(r.result.name, r.state, LABELS.get(r.stage, r.stage), f"{r.share:.0%}", r.error) for r in rooms]
    width = [max(len(row[i]) for row in rows) for i in range(4)]
    lines = [
        "  ".join([*(cell.ljust(w) for cell, w in zip(row, width, strict=False)), row[4]]).rstrip() for row in rows
    ]
    return "\n".join(lines)


def page(rooms: list[RoomState], folder: Path) -> str:
    """An HTML page over all rooms, which lies in `folder`: it links to the rooms' pages by relative paths."""
    body = []
    for room in rooms:
        name, page_path = html.escape(room.result.name), room.result.absolute() / PAGE
        if page_path.is_file():
            name = f'<a href="{html.escape(_link(page_path, folder))}">{name}</a>'
        seconds = sum(unit.seconds for unit in room.units)
        memory = max((unit.memory for unit in room.units), default=0)
        cells = [name, room.state, html.escape(LABELS.get(room.stage, room.stage)), f"{room.share:.0%}"]
        cells += [f"{seconds:.0f} s", f"{memory / 2**30:.1f} GiB", html.escape(room.error)]
        cells = "".join(f"<td>{cell}</td>" for cell in cells)
        body.append(f'<tr class="{room.state.replace(" ", "-")}">{cells}</tr>')
    head = "".join(f"<th>{title}</th>" for title in ("Room", "State", "Stage", "Done", "Time", "Memory", "Error"))
    done = sum(room.state == DONE for room in rooms)
    return _PAGE.format(done=done, count=len(rooms), head=head, body="\n".join(body))


def _link(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return path.as_uri()


_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Rooms</title><style>
body {{ font: 15px/1.5 sans-serif; margin: 2em; }} table {{ border-collapse: collapse; }}
td, th {{ padding: .2em 1em; border-bottom: 1px solid #ccc; text-align: left; }}
.failed td {{ background: #fdd; }} .done td {{ background: #dfd; }} .running td {{ background: #ffd; }}
</style></head><body><h1>Rooms</h1><p>{done} of {count} are done.</p>
<table><thead><tr>{head}</tr></thead><tbody>
{body}
</tbody></table></body></html>
"""
