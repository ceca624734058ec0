"""The command `demo`: a small room rendered, recovered, compared with its truth, relit."""

import argparse
from pathlib import Path
from typing import TextIO

from .common import add_common, add_settings, console_run, need, settings_from

DEMO_SIZES = ("tiny", "small", "large")


def add_demo(commands) -> None:
    """Add the command to the program's `commands`."""
    parser = commands.add_parser(
        "demo",
        help="render a small room, recover it, compare, relight",
        description="Render a small furnished room whose materials are known, recover it, print recovered against "
        "true values, and leave scene.blend and before_after.png in RESULT.",
    )
    parser.add_argument("--out", metavar="RESULT", type=Path, required=True, help="folder to write, made if missing")
    parser.add_argument("--size", choices=DEMO_SIZES, default="small", help="number and size of frames (default small)")
    add_settings(parser)
    add_common(parser, demo_command)


def demo_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`demo --out RESULT`."""
    settings = settings_from(arguments)
    demo = need("demo.run")
    with console_run(arguments, stream) as console:
        table = demo.run_demo(arguments.out, arguments.size, settings, **console)
    if not arguments.quiet:
        print(table, file=stream)
        print(
            f"\nOpen {arguments.out / 'scene.blend'} in Blender; the pictures: {arguments.out / 'before_after.png'}",
            file=stream,
        )
