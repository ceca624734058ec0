"""The graph of a room's units of work, which each engine is given in its own format."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.atomic import write_bytes
from ..core.errors import BadInputError, StorageError
from ..core.stages import RUN_STAGES

FOLDER = "farm"
"""Where a result folder keeps its plan, the workers' locks, marks and logs."""
PROGRAM = "scan-relight"


@dataclass(frozen=True)
class Task:
    """One unit of work, which one worker does.

    Attributes
    ----------
    name : str
        Unique in its room: the stage's, with "-I-of-N" for a block.
    block : tuple of int or None
        I and N, I from 1; None: the whole stage, or what joins its blocks.
    after : tuple of str
        Names of those that have to be done before.
    """

    name: str
    stage: str
    block: tuple[int, int] | None
    after: tuple[str, ...]


@dataclass(frozen=True)
class Room:
    """A room to recover.

    Attributes
    ----------
    capture, result : Path
        Absolute, as the workers find them.
    blocks : int
        Number of blocks into which a stage is divided, if it can be.
    program : tuple of str
        Command that starts Scan Relight on a worker.
    options : tuple of str
        The options of each unit: settings, how the capture is read.
    divided : tuple of str
        The stages that are divided into blocks.
    """

    capture: Path
    result: Path
    blocks: int = 1
    program: tuple[str, ...] = (PROGRAM,)
    options: tuple[str, ...] = ()
    divided: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the room."""
        return self.result.name

    @property
    def farm(self) -> Path:
        """Folder of the plan, locks, marks and logs."""
        return self.result / FOLDER

    def tasks(self) -> tuple[Task, ...]:
        """The units of work, each after those it waits for."""
        tasks: list[Task] = []
        before: tuple[str, ...] = ()
        for stage in RUN_STAGES:
            if stage in self.divided and self.blocks > 1:
                parts = [
                    Task(unit_name(stage, (i, self.blocks)), stage, (i, self.blocks), before)
                    for i in range(1, self.blocks + 1)
                ]
                tasks += parts
                before = tuple(part.name for part in parts)
            tasks.append(Task(stage, stage, None, before))
            before = (stage,)
        return tuple(tasks)

    def command(self, stage: str, block: str = "") -> list[str]:
        """The command line of a unit of work; `block` as "I/N", or what an engine puts there."""
        part = ["--block", block] if block else []
        unit = ["stage", str(self.capture), "--out", str(self.result), "--stage", stage, *part]
        return [*self.program, *unit, *self.options]

    def as_dict(self) -> dict[str, Any]:
        """The graph, for JSON."""
        tasks = [
            {
                "name": task.name,
                "stage": task.stage,
                "block": list(task.block) if task.block else None,
                "after": list(task.after),
                "command": self.command(task.stage, "{}/{}".format(*task.block) if task.block else ""),
            }
            for task in self.tasks()
        ]
        entry = {"room": self.name, "capture": str(self.capture), "result": str(self.result), "blocks": self.blocks}
        return entry | {"program": list(self.program), "options": list(self.options), "tasks": tasks}

    def write(self, name: str, content: str | dict[str, Any]) -> Path:
        """Write a file of the room's farm folder, a text or JSON, whole or not at all. Raises `StorageError`."""
        make_folder(self.farm)
        path = self.farm / name
        text = content if isinstance(content, str) else json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        write_bytes(path, text.encode())
        return path


def unit_name(stage: str, block: tuple[int, int] | None) -> str:
    """Name of a unit of work."""
    return f"{stage}-{block[0]}-of-{block[1]}" if block else stage


def make_folder(folder: Path) -> None:
    """Make a farm folder; raises `StorageError`."""
    if folder.is_symlink():
        raise StorageError(f"'{folder}' is a link, and workers would write elsewhere; put a folder in its place.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(
            f"Folder '{folder}' can't be made ({error.strerror or error}); choose another result folder."
        ) from error


def rooms_from(captures: list[Path], list_file: Path | None, results: Path, shared: dict[str, Any]) -> list[Room]:
    """The rooms that a command names.

    Parameters
    ----------
    captures : list of Path
        Their result folders have the same names, in `results`.
    list_file : Path, optional
        File with a capture in each line, followed by a tab and its result folder if that is not the default.
    shared : dict
        The other fields of each `Room`.

    Raises
    ------
    BadInputError
        There is no room, two would have one result folder, or the list can't be read.
    """
    folders = [(capture, results / capture.absolute().name) for capture in captures]
    if list_file is not None:
        try:
            lines = list_file.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise BadInputError(f"List of rooms '{list_file}' can't be read ({error}); give a text file.") from error
        for line in filter(str.strip, lines):
            capture, _, result = line.partition("\t")
            folder = list_file.parent / capture.strip()
            folders.append(
                (folder, list_file.parent / result.strip() if result.strip() else results / folder.absolute().name)
            )
    if not folders:
        raise BadInputError("No room is named; give the folders of captures, or --list FILE.")
    rooms = [Room(capture.absolute(), result.absolute(), **shared) for capture, result in folders]
    taken: dict[Path, Path] = {}
    for room in rooms:
        if room.result.resolve() == room.capture.resolve():
            raise BadInputError(f"Result folder '{room.result}' is the capture itself; choose another with --out.")
        if taken.setdefault(room.result, room.capture) != room.capture:
            raise BadInputError(
                f"Captures '{taken[room.result]}' and '{room.capture}' would both be written to '{room.result}'; "
                "give --list FILE with a result folder behind each, parted by a tab."
            )
    return list(dict.fromkeys(rooms))
