"""Slurm: each unit of work is a job, blocks are a job array, and `afterok` chains the jobs of a room."""

import re
import shlex
import subprocess

from ..core.errors import BadInputError, ScanRelightError
from .plan import Room, Task


def submit(room: Room, limits: dict[str, str]) -> list[str]:
    """Submit a room as a chain of jobs; returns their numbers.

    Their scripts and logs lie in the room's farm folder. Each room is a chain of its own: where one of its jobs fails,
    only the later jobs of that room are cancelled.

    Parameters
    ----------
    limits : dict of str to str
        Resources that jobs request, by sbatch's options; '' leaves them to the partition.

    Raises
    ------
    BadInputError
        There is no sbatch, or it refuses.
    StorageError
    """
    numbers: dict[str, str] = {}
    try:
        for task in room.tasks():
            first = _first(task)
            if first is not None and first in numbers:
                numbers[task.name] = numbers[first]
                continue
            after = list(dict.fromkeys(numbers[name] for name in task.after))
            script = room.write(f"{task.stage}{'-blocks' if task.block else ''}.sh", script_of(room, task, limits))
            chain = [f"--dependency=afterok:{':'.join(after)}", "--kill-on-invalid-dep=yes"] if after else []
            numbers[task.name] = _sbatch([*chain, str(script)])
    except ScanRelightError:
        if numbers:  # half a chain is of no use
            subprocess.run(["scancel", *dict.fromkeys(numbers.values())], capture_output=True, check=False)
        raise
    return list(dict.fromkeys(numbers.values()))


def _first(task: Task) -> str | None:
    """Name of the block that is submitted for a task's whole array; None for that block itself, and without blocks."""
    return None if task.block is None or task.block[0] == 1 else task.name.replace(f"-{task.block[0]}-of", "-1-of")


def script_of(room: Room, task: Task, limits: dict[str, str]) -> str:
    """The batch script of a unit of work, or of all blocks of a stage."""
    log = f"{room.farm}/{task.stage}".replace("%", "%%") + "-%j.log"
    options = limits | {"job-name": f"{_plain(room.name)}:{task.name if not task.block else task.stage}", "output": log}
    if task.block:
        options["array"] = f"1-{task.block[1]}"
    for value in options.values():
        if "\n" in value or '"' in value:
            raise BadInputError(f"Slurm takes no line break and no double quote in '{value}'; name it otherwise.")
    lines = [f'#SBATCH --{name}="{value}"' for name, value in options.items() if value]
    block = f"$SLURM_ARRAY_TASK_ID/{task.block[1]}" if task.block else ""
    words = [f'"{word}"' if word == block else shlex.quote(word) for word in room.command(task.stage, block)]
    return "\n".join(["#!/bin/sh", *lines, f"exec {' '.join(words)}", ""])


def _plain(name: str) -> str:
    return re.sub(r"[^\w.-]", "_", name)


def _sbatch(arguments: list[str]) -> str:
    try:
        done = subprocess.run(["sbatch", "--parsable", *arguments], capture_output=True, text=True, check=False)
    except OSError as error:
        raise BadInputError("Slurm's 'sbatch' can't be run here; submit from a machine of the cluster.") from error
    number = done.stdout.strip().partition(";")[0]
    if done.returncode or not number.isdigit():
        raise BadInputError(f"Slurm refused the job ({' '.join(done.stderr.split())}); check partition and limits.")
    return number
