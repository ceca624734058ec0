"""`scan-relight benchmark ablation`: how much each pass improves the result."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from ..core.errors import BadInputError
from ..core.settings import PRESETS
from .common import add_common

NAMES = ("benchmark", "ablation")
"""How it is called."""
COMMAND = "-".join(NAMES)
"""What that is made into, as a command has one word."""


def joined(argv: Sequence[str] | None) -> list[str]:
    """The arguments with the command's two words joined into one."""
    argv = list(sys.argv[1:] if argv is None else argv)
    return [COMMAND, *argv[2:]] if tuple(argv[:2]) == NAMES else argv


def add_ablation(commands) -> None:
    """Add the command to the program's `commands`."""
    parser = commands.add_parser(
        COMMAND,
        prog=f"scan-relight {' '.join(NAMES)}",
        description="Recover rooms with truth, whole and without each pass, one at a time, and tell what each pass "
        "gains and costs. What OUT/ablation.jsonl holds already is not done again.",
    )
    parser.add_argument("rooms", metavar="ROOM", type=Path, nargs="*", help="captures with truth/ beside the frames")
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder of the runs, made if missing")
    parser.add_argument("--list", action="store_true", help="name the passes and end")
    parser.add_argument("--passes", metavar="PASS", nargs="+", default=(), help="only these (default all)")
    parser.add_argument("--seeds", metavar="INT", type=int, nargs="+", default=(0, 1), help="default 0 1")
    parser.add_argument("--preset", choices=tuple(PRESETS), default="normal", help="of the settings (default normal)")
    parser.add_argument("--threads", type=int, metavar="INT", default=1, help="0 takes all cores (default 1)")
    limit = "begin no further run after (default 0, none)"
    parser.add_argument("--limit-minutes", type=float, metavar="FLOAT", default=0.0, help=limit)
    table = "run nothing, and write the table of all OUT/ablation*.jsonl as Markdown, with a plot beside it"
    parser.add_argument("--table", metavar="FILE", type=Path, help=table)
    add_common(parser, ablation_command)


def ablation_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`benchmark ablation ROOM ... --out DIR`, or with `--list` or `--table FILE`."""
    from ..core.passes.registry import passes

    if arguments.list:
        width = max(len(item.name) for item in passes())
        for item in passes():
            print(f"{item.name:{width}}  {item.stage:11}  {item.does}", file=stream)
        return
    if arguments.out is None:
        raise BadInputError("Option --out names the folder of the runs; give it.")
    if arguments.table is not None:
        from ..benchmark.ablation_table import write_report

        write_report(arguments.out, arguments.table)
        if not arguments.quiet:
            print(f"Table: {arguments.table}", file=stream)
        return
    if not arguments.rooms:
        raise BadInputError("Name at least one room: a capture with truth/ beside its frames.")
    if min(arguments.seeds) < 0 or arguments.threads < 0:
        raise BadInputError("Options --seeds and --threads take whole numbers of at least 0.")
    from ..benchmark.ablation import Ablation, run_ablation

    ablation = Ablation(
        arguments.rooms,
        arguments.out,
        arguments.seeds,
        arguments.passes,
        arguments.preset,
        arguments.threads,
        60 * arguments.limit_minutes,
    )

    def tell(text: str) -> None:
        if not arguments.quiet:
            print(text, file=stream, flush=True)

    tell(f"Runs: {run_ablation(ablation, tell)}")
