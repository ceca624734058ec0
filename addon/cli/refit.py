"""Corrections on the command line: their options, and the command `refit`."""

import argparse
from pathlib import Path
from typing import TextIO

from ..console import duration
from .common import add_common, console_run, need, tell_end


def add_override(parser: argparse.ArgumentParser) -> None:
    """Add the options that give a run what is known of objects."""
    known = "JSON of what is known of objects; merged into RESULT/overrides.json, which runs heed"
    parser.add_argument("--override", metavar="FILE", type=Path, help=known)
    parser.add_argument("--no-overrides", action="store_true", help="don't heed what RESULT/overrides.json keeps")


def add_refit(commands) -> None:
    """Add the command to the program's `commands`."""
    parser = commands.add_parser(
        "refit",
        help="fit a few objects of a result again, in seconds",
        description="Fit objects of RESULT again with all else held, heeding what is given of them, and write the "
        "result anew. The capture is not needed; RESULT has to hold its stages.",
    )
    parser.add_argument("result", metavar="RESULT", type=Path, help="folder that 'recover' wrote")
    which = "object to fit, may be repeated (default those of which something new is given)"
    parser.add_argument("--object", metavar="ID", type=int, action="append", default=[], dest="objects", help=which)
    scene = "also write scene.blend anew (default yes)"
    parser.add_argument("--scene", action=argparse.BooleanOptionalAction, default=True, help=scene)
    add_override(parser)
    add_common(parser, refit_command, leash=True)


def refit_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`refit RESULT --object ID`."""
    from ..core.progress import Progress

    refit = need("job.run")
    with console_run(arguments, stream) as console:
        report = refit.refit(
            arguments.result,
            arguments.objects,
            Progress(weights=refit.REFIT_WEIGHTS, **console),
            arguments.override,
            not arguments.no_overrides,
            arguments.scene,
        )
    seconds, objects = report["refit"]["seconds"], report["refit"]["objects"]
    line = f"Fitted again in {duration(seconds)}: object {', '.join(map(str, objects))} of {arguments.result}"
    values = {"seconds": seconds, "result": str(arguments.result.absolute()), "objects": objects}
    tell_end(arguments, stream, console["listener"], report["warnings"], line, **values)
