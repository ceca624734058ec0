"""The command `join`: the parts of a building, recovered one by one, as one scene."""

import argparse
from pathlib import Path
from typing import TextIO

from ..cli.common import add_common, need, tell_end
from ..core.io.folder import SCENE


def add_join(commands) -> None:
    """Add the parser of the command to the program's `commands`."""
    parser = commands.add_parser(
        "join",
        help="put the recovered parts of a building together",
        description="Put the results of a building's parts, as `divide` made them, together as one scene. Images stay "
        "in RESULT, so move all folders together.",
    )
    add = parser.add_argument
    add("results", metavar="RESULT", type=Path, nargs="+", help="result folders of the parts")
    add("--out", metavar="FOLDER", type=Path, required=True, help="where scene.blend goes, made if missing")
    add_common(parser, join_command)


def join_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`join RESULT... --out FOLDER`."""
    remarks = need("scene.join").join(arguments.results, arguments.out)
    tell_end(arguments, stream, None, remarks, f"Done: {arguments.out / SCENE}")
