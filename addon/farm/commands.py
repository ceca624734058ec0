"""The farm's commands: `stage` does one unit of work; `plan`, `submit` and `status` handle whole rooms."""

import argparse
import json
import re
import shlex
from pathlib import Path
from typing import TextIO

from ..cli.common import (
    add_common,
    add_reading,
    add_settings,
    complain,
    console_run,
    needed_packages,
    settings_from,
    tell_end,
)
from ..cli.recover import add_result_options, run_from
from ..console import duration
from ..core.errors import EXIT_OK, BadInputError, ScanRelightError
from ..core.stages import RUN_STAGES, WRITE
from ..settings_info import setting_infos
from .plan import PROGRAM, Room, rooms_from

ENGINES = ("slurm", "flamenco", "openjd")


def add_farm(commands) -> None:
    """Add the parsers of the farm's commands to the program's `commands`."""
    unit = commands.add_parser(
        "stage",
        help="do one stage of a recovery, or a block of one, as farms do",
        description="Do one stage of a recovery from what is finished in RESULT. May be done twice, by several at "
        "once, killed and done again: what it stores is whole, and the same as in a run on one machine.",
    )
    unit.add_argument("capture", metavar="CAPTURE", type=Path, help="folder of the capture")
    unit.add_argument("--out", metavar="RESULT", type=Path, required=True, help="result folder, made if missing")
    unit.add_argument("--stage", choices=RUN_STAGES, required=True, help="what to do")
    block = "of the stage, the I-th of N parts alone; the stage without --block joins them"
    unit.add_argument("--block", metavar="I/N", type=_block, help=block)
    add_reading(unit)
    add_result_options(unit)
    add_settings(unit)
    add_common(unit, stage_command, leash=True)

    plan = commands.add_parser(
        "plan",
        help="print the units of work of a recovery, and which waits for which, as JSON",
        description="Print the units of work of each room as JSON, each with its command.",
    )
    _add_rooms(plan)
    add_common(plan, plan_command, quiet=False)

    submit = commands.add_parser(
        "submit",
        help="hand rooms to a farm",
        description="Hand the recovery of rooms to a farm. A room that can't be handed over stops no other.",
    )
    submit.add_argument("--engine", choices=ENGINES, required=True, help="openjd writes a template alone")
    _add_rooms(submit)
    slurm = submit.add_argument_group("Slurm").add_argument
    slurm("--partition", metavar="NAME", default="", help="where jobs run")
    slurm("--time", metavar="LIMIT", default="", help="limit of a job, as sbatch takes it (default the partition's)")
    slurm("--mem", metavar="SIZE", default="", help="memory of a job, as sbatch takes it")
    slurm("--cpus", metavar="COUNT", type=int, default=0, help="cores of a job")
    flamenco = submit.add_argument_group("Flamenco").add_argument
    flamenco("--manager", metavar="URL", default="", help="the manager's address")
    flamenco("--priority", metavar="NUMBER", type=int, default=50, help="of the jobs (default 50)")
    add_common(submit, submit_command)

    status = commands.add_parser(
        "status",
        help="tell how far rooms are",
        description="Tell each room's stage, share and error. The exit code is 1 where a room has failed.",
    )
    status.add_argument("results", metavar="RESULT", type=Path, nargs="+", help="result folders")
    status.add_argument("--json", action="store_true", help="machine-readable")
    status.add_argument("--page", metavar="FILE", type=Path, help="also write an HTML page over all rooms")
    add_common(status, status_command, quiet=False)


def _add_rooms(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("rooms", metavar="CAPTURE", type=Path, nargs="*", help="folders of captures, as the workers see them too")
    add("--list", metavar="FILE", type=Path, help="a capture in each line; behind a tab its result folder, if another")
    where = "folder of the result folders, called as the captures are (default here)"
    add("--out", metavar="FOLDER", type=Path, default=Path(), help=where)
    add("--blocks", metavar="N", type=int, default=1, help="parts of a stage that can be divided (default 1)")
    add("--program", metavar="COMMAND", default=PROGRAM, help=f"what a worker calls (default {PROGRAM})")
    add_reading(parser)
    add_result_options(parser)
    add_settings(parser)


def _block(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    if not match or not 1 <= int(match[1]) <= int(match[2]):
        raise argparse.ArgumentTypeError(f"'{text}' is no block; give I/N, with I from 1 to N")
    return int(match[1]), int(match[2])


def options_of(arguments: argparse.Namespace) -> list[str]:
    """The options that pass `arguments` on to a unit of work; paths in them are absolute."""
    given = [f"--preset={arguments.preset}"]
    for info in setting_infos():
        value, option = getattr(arguments, info.name), info.name.replace("_", "-")
        if value is not None:
            given.append(f"--{'' if value else 'no-'}{option}" if info.kind is bool else f"--{option}={value}")
    given += [f"--without={name}" for name in arguments.without or ()]
    texts = ("format", "transfer", "convention", "white", "unwrap")
    paths = ("mesh", "exposures", "segments", "override")
    for name in texts + paths:
        if value := getattr(arguments, name):
            given.append(f"--{name}={value.absolute() if isinstance(value, Path) else value}")
    flags = {"outside": arguments.outside, "no-scene": not arguments.scene, "no-overrides": arguments.no_overrides}
    return given + [f"--{flag}" for flag, wanted in flags.items() if wanted]


def stage_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`stage CAPTURE --out RESULT --stage NAME [--block I/N]`."""
    settings = settings_from(arguments)
    run = run_from(arguments, until=arguments.stage, alone=True, block=arguments.block)
    with needed_packages():
        from ..core.pipeline.run import progress_of_run
        from .unit import unit
    done = arguments.out, arguments.stage, arguments.block
    with console_run(arguments, stream) as console, unit(*done, console["should_stop"]):
        report = run(arguments.capture, arguments.out, settings, progress_of_run(**console))
    line = f"Done in {duration(report['seconds'])}: stage '{arguments.stage}' of {arguments.out}"
    values = {"seconds": report["seconds"], "result": str(arguments.out.absolute()), "until": arguments.stage}
    warnings = report.get("warnings", ()) if arguments.stage == WRITE else ()
    tell_end(arguments, stream, console["listener"], warnings, line, **values)


def _rooms(arguments: argparse.Namespace) -> list[Room]:
    settings = settings_from(arguments)
    if arguments.unwrap and arguments.scene:
        raise BadInputError("Option --unwrap goes with --no-scene: the scene is laid out by Blender.")
    with needed_packages():
        from ..core.pipeline.stages import STAGES
    divided = tuple(stage.name for stage in STAGES if stage.divided_by and stage.name not in settings.published)
    if arguments.blocks < 1:
        raise BadInputError(f"A stage can't be divided into {arguments.blocks} blocks; give 1 or more.")
    program, options = tuple(shlex.split(arguments.program)) or (PROGRAM,), tuple(options_of(arguments))
    shared = {"blocks": arguments.blocks, "program": program, "options": options, "divided": divided}
    return rooms_from(arguments.rooms, arguments.list, arguments.out, shared)


def plan_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`plan CAPTURE --blocks N`."""
    rooms = [room.as_dict() for room in _rooms(arguments)]
    print(json.dumps({"rooms": rooms}, indent=1, ensure_ascii=False), file=stream)


def submit_command(arguments: argparse.Namespace, stream: TextIO) -> int:
    """`submit --engine ENGINE CAPTURE...`; the exit code is that of the last room that could not be handed over."""
    code = EXIT_OK
    for room in _rooms(arguments):
        try:
            if not room.capture.is_dir():
                raise BadInputError(f"Capture '{room.capture}' is no folder; check the path.")
            room.write("plan.json", room.as_dict())
            line = _hand_over(arguments, room)
        except ScanRelightError as error:
            code = complain(f"Room '{room.name}' was not handed over: {error}", error.exit_code)
            continue
        if not arguments.quiet:
            print(f"{room.name}: {line}", file=stream)
    return code


def _hand_over(arguments: argparse.Namespace, room: Room) -> str:
    if arguments.engine == "slurm":
        from . import slurm

        limits = {"partition": arguments.partition, "time": arguments.time, "mem": arguments.mem}
        limits["cpus-per-task"] = str(arguments.cpus or "")
        return f"jobs {', '.join(slurm.submit(room, limits))}"
    if arguments.engine == "flamenco":
        from . import flamenco

        return f"job {flamenco.submit(room, arguments.manager, arguments.priority)}"
    from . import openjd

    return str(openjd.write(room))


def status_command(arguments: argparse.Namespace, stream: TextIO) -> int:
    """`status RESULT...`."""
    from .status import FAILED, page, room_state, table

    rooms = [room_state(result) for result in arguments.results]
    if arguments.page:
        from ..core.atomic import write_bytes

        write_bytes(arguments.page, page(rooms, arguments.page.absolute().parent).encode())
    if arguments.json:
        print(json.dumps({"rooms": [room.as_dict() for room in rooms]}, indent=1, ensure_ascii=False), file=stream)
    else:
        print(table(rooms), file=stream)
    return int(any(room.state == FAILED for room in rooms))
