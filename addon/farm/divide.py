"""The command `divide`: a building as many captures, each of which one machine recovers."""

import argparse
from pathlib import Path
from typing import TextIO

from ..cli.common import add_common, add_reading, needed_packages, reading_from
from ..core.errors import BadInputError


def add_divide(commands) -> None:
    """Add the parser of the command to the program's `commands`."""
    parser = commands.add_parser(
        "divide",
        help="divide the capture of a building into parts that are recovered one by one",
        description="Divide a capture that is too large for one run into captures of its parts: PARTS/01, PARTS/02 ... "
        "Each is recovered as any capture is, here or on a farm; `join` puts the results together.",
    )
    add = parser.add_argument
    add("capture", metavar="CAPTURE", type=Path, help="folder of the capture")
    add("--out", metavar="PARTS", type=Path, required=True, help="folder for the parts, made if missing")
    number = parser.add_mutually_exclusive_group()
    number.add_argument("--parts", metavar="N", type=int, default=0, help="how many (default as memory asks for)")
    memory = "that a part's recovery may take (default as of a run on this machine)"
    number.add_argument("--memory", metavar="GB", type=float, default=0.0, help=memory)
    add_reading(parser)
    add_common(parser, divide_command)


def divide_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`divide CAPTURE --out PARTS`."""
    if arguments.parts < 0 or arguments.memory < 0:
        raise BadInputError("A number of parts, or of gigabytes, is more than 0; leave the option out or give such.")
    if arguments.out.exists() and (not arguments.out.is_dir() or any(arguments.out.iterdir())):
        raise BadInputError(f"'{arguments.out}' is there and not empty; choose another folder for the parts.")
    reading = reading_from(arguments)
    with needed_packages():
        from ..core.io.part import part_in, write_part
        from ..core.io.read import read_capture
        from ..core.memory import SHARE, free_memory
        from ..core.scene.closed_mesh import without_closing
        from ..core.scene.division import divided, parts_for, seen_by
        from ..core.scene.rays import RayScene
    part = part_in(arguments.capture)
    if part is not None:
        raise BadInputError(f"'{arguments.capture}' is a part already; divide '{part.whole}' into more.")
    whole = without_closing(read_capture(arguments.capture, reading))  # each part's holes are closed where it is read
    if not whole.frames:
        raise BadInputError(f"Capture '{arguments.capture}' has no frames, by which it would be divided; recover it.")
    scene = RayScene(whole.mesh.vertices, whole.mesh.triangles)
    seen = seen_by(whole.mesh, scene, [frame.camera for frame in whole.frames])
    limit = arguments.memory * 1e9 or SHARE * (free_memory() or 0)
    count = arguments.parts or parts_for(seen, limit)
    parts = divided(whole.mesh, scene, seen, count)
    digits = max(2, len(str(len(parts))))
    for number, part in enumerate(parts, 1):
        folder = arguments.out / f"{number:0{digits}}"
        write_part(folder, whole, part, reading)
        if not arguments.quiet:
            near, far = int((~part.far).sum()), int(part.far.sum())
            print(f"{folder}: {near} triangles, {far} of other parts, {len(part.frames)} frames", file=stream)
