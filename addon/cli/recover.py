"""The command `recover`: its options, and the run with Blender or without."""

import argparse
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from ..console import duration
from ..core.errors import BadInputError
from ..core.stages import RUN_STAGES, WRITE
from .common import (
    add_common,
    add_reading,
    add_settings,
    console_run,
    need,
    needed_packages,
    reading_from,
    settings_from,
    tell_end,
)
from .refit import add_override

UNWRAPS = ("blender", "xatlas", "own")
"""As `api.UNWRAPS`, which takes numpy."""


def add_recover(commands) -> None:
    """Add the command to the program's `commands`."""
    parser = commands.add_parser(
        "recover",
        help="recover a capture into a relightable scene",
        description="Recover a capture and write scene.blend, its images and a report. A stopped or repeated run goes "
        "on from the finished stages in RESULT.",
    )
    add = parser.add_argument
    holds = "folder with transforms.json, mesh.ply, info_semantic.json and the frames"
    add("capture", metavar="CAPTURE", type=Path, help=holds)
    add("--out", metavar="RESULT", type=Path, required=True, help="folder to write, made if missing")
    add_reading(parser)
    last = f"last stage to do: {', '.join(RUN_STAGES)} (default write, which is all)"
    add("--until", metavar="STAGE", choices=RUN_STAGES, default=WRITE, help=last)
    anew = "do this stage and all later ones anew, though they are stored"
    add("--from-stage", metavar="STAGE", choices=RUN_STAGES, help=anew)
    add_result_options(parser)
    add_settings(parser)
    add_common(parser, recover_command, leash=True)


def add_result_options(parser: argparse.ArgumentParser) -> None:
    """Add the options on how the result is made: with Blender or without, and with what is known of objects."""
    scene = "also write scene.blend, which takes Blender's bpy (default yes)"
    parser.add_argument("--scene", action=argparse.BooleanOptionalAction, default=True, help=scene)
    layout = "with --no-scene: what lays out the atlas; own: the mesh's own texture coordinates (default: the first of "
    parser.add_argument("--unwrap", choices=UNWRAPS, default="", help=f"{layout}them that is installed)")
    add_override(parser)
    known = parser.add_mutually_exclusive_group()
    part = "a part of known albedo, by name or number: it fixes each channel's scale (default 0.8, white paint)"
    known.add_argument("--white", metavar="PART[=ALBEDO]", default="", help=part)
    pixel = "a pixel, from the picture's top left, that shows a known albedo (default 0.18, a grey card): as --white"
    known.add_argument("--grey", metavar="FRAME:X,Y[=ALBEDO]", dest="white", type=_grey, help=pixel)


def _grey(text: str) -> str:
    """Check that the text of `--grey` names a pixel, and return it: `--white` takes it as well."""
    if not re.fullmatch(r".+:\s*\d+\s*,\s*\d+\s*(=.*)?", text):
        raise argparse.ArgumentTypeError(f"'{text}' names no pixel; give FRAME:X,Y or FRAME:X,Y=ALBEDO")
    return text


def run_from(arguments: argparse.Namespace, **stages) -> Callable[..., dict[str, Any]]:
    """The requested run, `stages` as fields of `Request`: called with capture, result, settings and progress."""
    if arguments.unwrap and arguments.scene:
        raise BadInputError("Option --unwrap goes with --no-scene: the scene is laid out by Blender.")
    reading = reading_from(arguments)
    with needed_packages():
        from ..core.pipeline.run import Request

        corrections = {
            "override": arguments.override,
            "heed_kept": not arguments.no_overrides,
            "white": arguments.white,
        }
        request = Request(reading=reading, **corrections, **stages)
        request.check(arguments.capture, arguments.out)
        if arguments.scene:
            return partial(need("job.run").run, request=request)
        from ..api import run_without_scene

        return partial(run_without_scene, request=request, unwrap=arguments.unwrap)


def recover_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`recover CAPTURE --out RESULT`."""
    settings = settings_from(arguments)
    run = run_from(arguments, until=arguments.until, from_stage=arguments.from_stage)
    with needed_packages():
        from ..core.pipeline.run import progress_of_run
    with console_run(arguments, stream) as console:
        report = run(arguments.capture, arguments.out, settings, progress_of_run(**console))
    made = "stages" if arguments.until != WRITE else "scene.blend" if arguments.scene else "materials.json"
    line = f"Done in {duration(report['seconds'])}: {arguments.out / made}"
    values = {"seconds": report["seconds"], "result": str(arguments.out.absolute()), "until": arguments.until}
    tell_end(arguments, stream, console["listener"], report.get("warnings", ()), line, **values)
