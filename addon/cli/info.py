"""The command `info`: what a capture holds, and what is wrong with it."""

import argparse
import json
from pathlib import Path
from typing import TextIO

from ..leash import Leash
from .common import add_common, add_reading, needed_packages, reading_from


def add_info(commands) -> None:
    """Add the command to the program's `commands`."""
    parser = commands.add_parser(
        "info",
        help="say what a capture holds, and what is wrong with it",
        description="Read and check a capture without recovering anything.",
    )
    parser.add_argument("capture", metavar="CAPTURE", type=Path, help="folder of the capture")
    parser.add_argument("--json", action="store_true", help="machine-readable")
    parser.add_argument("--room", metavar="FOLDER", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--stop-with-stdin", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--no-look", action="store_true", help="don't compare the frames with the mesh")
    edges = "write frames with the mesh's edges drawn over them"
    parser.add_argument("--overlay", metavar="PNG", type=Path, help=edges)
    add_reading(parser)
    add_common(parser, info_command, quiet=False)


def info_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`info CAPTURE`."""
    from ..core.io.read import describe, read_capture

    if arguments.stop_with_stdin:
        Leash(grace=0.0)
    capture = read_capture(arguments.capture, reading_from(arguments))
    if arguments.room is not None:
        from ..core.results.room_file import write_room

        write_room(arguments.room, capture)
    facts = describe(capture)
    if capture.frames and not arguments.no_look:
        facts["agreement"] = compare(capture, arguments)
    if arguments.json:
        print(json.dumps(facts, indent=1), file=stream)
        return
    extent = " x ".join(f"{length:.2f}" for length in facts["extent_m"])
    sizes = ", ".join(f"{count} of {size}" for size, count in facts["resolutions"].items())
    lenses = ", ".join(f"{count} of {name}" for name, count in facts["lenses"].items())
    lenses = f"; lenses: {lenses}" if set(facts["lenses"]) - {"PINHOLE"} else ""
    details = f": {sizes} pixels; {facts['masks']} with a mask{lenses}" if facts["frames"] else ""
    mesh = f"{facts['triangles']} triangles, {facts['vertices']} vertices, {facts['area_m2']:.1f} m2, {extent} m"
    lines = [
        f"{facts['capture']} ({facts['format']})",
        f"  frames     {facts['frames']}{details}",
        f"  mesh       {mesh}",
        f"  instances  {len(facts['instances'])}",
    ]
    for item in facts["instances"]:
        lines.append(f"    {item['object_id']:>5}  {item['class_name']:<24} {item['triangles']:>8} triangles")
    lines += [f"  warning    {warning}" for warning in facts["warnings"]]
    lines += [f"  poses      {sentence}" for sentence in facts.get("agreement", {}).get("sentences", ())]
    print("\n".join(lines), file=stream)


def compare(capture, arguments: argparse.Namespace) -> dict:
    """Whether frames and mesh fit, ready for JSON; writes the overlay if its path was given."""
    with needed_packages():
        from ..core.agreement.look import look
        from ..core.agreement.overlay import overlay
        from ..core.atomic import write_bytes
        from ..core.io.conventions import Convention
        from ..core.io.pixels import read_pixels
        from ..core.io.png import png

        fit = look(capture, read_pixels, search=not arguments.convention)
        if arguments.overlay is not None:
            columns = [Convention()] + ([fit.best.convention] if fit.best else [])
            write_bytes(arguments.overlay, png(overlay(capture, read_pixels, columns)))
    return {
        "fits": fit.fits,
        "quality": fit.as_read.quality,
        "hit": fit.as_read.hit,
        "convention": str(fit.best.convention) if fit.best else None,
        "misaligned_pixels": fit.misaligned.round(3).tolist(),
        "sentences": fit.sentences(),
    }
