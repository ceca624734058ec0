"""Furnished rooms with truth, rendered by Cycles as captures, for finding out where the recovery fails.

    python -m scripts.qa_rooms make KIND OUT [--seed 1] [--frames 48] [--size 240x180] [--samples 64] [--views 6]
        [--denoise] [--ground 100]
    python -m scripts.qa_rooms score CAPTURE RESULT

KIND is kitchen, bathroom, bedroom, office, hall or study. `score` needs no rendering; it reads what
`scan-relight recover CAPTURE --out RESULT` left. Run from the repository's root.
"""

import argparse
import sys
from pathlib import Path


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="qa_rooms", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("make", help="render a room")
    make.add_argument("kind")
    make.add_argument("out", type=Path)
    make.add_argument("--seed", type=int, default=1)
    make.add_argument("--frames", type=int, default=48)
    make.add_argument("--size", default="240x180")
    make.add_argument("--samples", type=int, default=64)
    make.add_argument("--views", type=int, default=6)
    make.add_argument("--denoise", action="store_true")
    make.add_argument("--ground", type=float, default=0, help="edge of a ground around the room, in rooms; 0: none")
    score = commands.add_parser("score", help="compare a result with the truth")
    score.add_argument("capture", type=Path)
    score.add_argument("result", type=Path)
    options = parser.parse_args(argv)
    if options.command == "make":
        from .render import render
        from .rooms import ROOMS

        width, height = map(int, options.size.split("x"))
        room = ROOMS[options.kind](options.seed)
        if options.ground:
            room.surround(options.ground)
        render(room, options.out, options.frames, (width, height), options.samples, options.views, options.denoise)
    else:
        from .score import table

        sys.stdout.write(table(options.capture, options.result))


if __name__ == "__main__":
    main()
