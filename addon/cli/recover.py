"""The command `recover`: its options, how a capture is read, with a scene or without."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TextIO

from ..console import duration
from ..core.errors import EXIT_OK, BadInputError
from ..core.stages import RUN_STAGES, WRITE
from .common import add_reading, console_run, need, needed_packages, reading_from, settings_from, tell_end
from .refit import add_override

UNWRAPS = ("blender", "xatlas", "own")
"""As `api.UNWRAPS`, which takes numpy."""


def add_recover(commands, epilog: str) -> argparse.ArgumentParser:
    """Add the parser of `recover` to the program's `commands`; its settings come after."""
    parser = commands.add_parser(
        "recover",
        help="recover a capture into a relightable scene",
        epilog=epilog,
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
    scene = "also write scene.blend, which takes Blender's bpy (default yes)"
    add("--scene", action=argparse.BooleanOptionalAction, default=True, help=scene)
    layout = "with --no-scene: what lays out the atlas; own: the mesh's own texture coordinates (default: the first of "
    add("--unwrap", choices=UNWRAPS, default="", help=f"{layout}them that is installed)")
    add_override(parser)
    return parser


def recover_command(arguments: argparse.Namespace, stream: TextIO) -> int:
    """`recover CAPTURE --out RESULT`."""
    settings = settings_from(arguments)
    if arguments.unwrap and arguments.scene:
        raise BadInputError("Option --unwrap goes with --no-scene: the scene is laid out by Blender.")
    how = {
        "until": arguments.until,
        "reading": reading_from(arguments),
        "from_stage": arguments.from_stage,
        "override": arguments.override,
        "heed_kept": not arguments.no_overrides,
    }
    with needed_packages():
        if arguments.scene:
            run = need("job.run").run
        else:
            from ..api import run_without_scene as run

            how["unwrap"] = arguments.unwrap
        from ..core.pipeline.run import progress_of_run
    with console_run(arguments, stream) as console:
        report = run(arguments.capture, arguments.out, settings, progress_of_run(**console), **how)
    made = "stages" if arguments.until != WRITE else "scene.blend" if arguments.scene else "materials.json"
    line = f"Done in {duration(report['seconds'])}: {arguments.out / made}"
    told = {"seconds": report["seconds"], "result": str(arguments.out.absolute()), "until": arguments.until}
    tell_end(arguments, stream, console["listener"], report.get("warnings", ()), line, **told)
    return EXIT_OK
