"""The command `relight`: its options, and the calls of the bridge that they stand for."""

import argparse
from pathlib import Path
from typing import TextIO

from ..core.errors import BadInputError
from .common import add_common, console_run, need, tell_end


def add_relight(commands) -> None:
    """Add the command to the program's `commands`."""
    parser = commands.add_parser(
        "relight",
        help="render a result's scene under another light",
        description="Render RESULT/scene.blend with its lamps changed and new lights added. The scene is not changed. "
        "New lights take a strength: a factor on the room's own light, 1 if none is given, or radiant "
        "watts or lumens, as in 20W or 800lm.",
    )
    parser.add_argument("result", metavar="RESULT", type=Path, help="folder that 'recover' wrote")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="picture to write: .png, .jpg or .exr")
    add = parser.add_argument_group("light").add_argument
    which = "the lamps of the scan; a name means one lamp or all of its class (default as saved)"
    add("--lamps", metavar="on|off|NAME=FACTOR,...", help=which)
    turned = "the light from outside; an angle turns it, anticlockwise from above (default as saved)"
    add("--world", metavar="on|off|DEGREES", help=turned)
    add("--world-strength", metavar="FACTOR", type=positive, help="of the light from outside (default as saved)")
    add("--hdri", metavar="FILE", type=Path, help="equirectangular picture to put around the room")
    for name, text in (
        ("window", "a window's soft light from the side"),
        ("softbox", "a studio light by the camera"),
        ("spot", "a spot from above"),
        ("sun", "a low, warm sun from the side"),
    ):
        add(f"--{name}", metavar="STRENGTH", type=strength, nargs="?", const=(1.0, "ROOM"), help=f"add {text}")
    kelvin = "temperature of the new lights, 1700 to 20000 (default what suits each)"
    add("--kelvin", metavar="KELVIN", type=positive, help=kelvin)
    add = parser.add_argument_group("picture").add_argument
    add("--camera", metavar="NUMBER|NAME", help="frame to look through, from 0 (default the first)")
    add("--before-after", action="store_true", help="the captured light beside the new one")
    add("--samples", metavar="INT", type=int, default=0, help="for each pixel, 0 takes the scene's (default 0)")
    add("--size", metavar="PERCENT", type=int, default=100, help="of the frame (default 100)")
    engine = "eevee needs a graphics card (default cycles)"
    add("--engine", choices=("cycles", "eevee"), default="cycles", help=engine)
    device = "what Cycles renders on; KIND is optix, cuda, hip, metal or oneapi (default the processor)"
    add("--device", metavar="cpu|gpu|KIND", help=device)
    add("--scene", metavar="NAME", help="where the file holds several (default its active one)")
    add_common(parser, relight_command, leash=True)


def positive(text: str) -> float:
    """A number of at least 0 from the command line."""
    value = float(text)
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of at least 0")
    return value


def strength(text: str) -> tuple[float, str]:
    """A new light's strength and its unit: `0.5`, `20W` or `800lm`."""
    for ending, unit in (("lm", "LUMEN"), ("w", "WATT"), ("", "ROOM")):
        if text.lower().endswith(ending):
            try:
                return positive(text[: len(text) - len(ending)]), unit
            except ValueError:
                break
    raise argparse.ArgumentTypeError(f"'{text}' is not a strength, such as 0.5, 20W or 800lm")


def relight_command(arguments: argparse.Namespace, stream: TextIO) -> None:
    """`relight RESULT --out FILE`."""
    from ..core.progress import Progress

    if arguments.samples < 0 or not 1 <= arguments.size <= 1000:
        raise BadInputError("Option --samples takes a number of at least 0, and --size 1 to 1000 percent.")
    command = need("relight.command")
    added = {
        kind: getattr(arguments, name) for name, kind in command.OPTIONS.items() if getattr(arguments, name) is not None
    }
    light = command.Light(
        arguments.lamps, arguments.world, arguments.world_strength, arguments.hdri, added, arguments.kelvin
    )
    with console_run(arguments, stream) as console:
        stages = ("before", "after") if arguments.before_after else ("after",)
        progress = Progress(weights=dict.fromkeys(stages, 1.0), **console)
        remarks = command.relight(
            arguments.result,
            light,
            arguments.out,
            arguments.camera,
            arguments.samples,
            arguments.engine.upper(),
            arguments.before_after,
            arguments.size,
            progress,
            arguments.device,
            arguments.scene,
        )
    values = {"picture": str(arguments.out.absolute())}
    tell_end(arguments, stream, console["listener"], remarks, f"Done: {arguments.out}", kind="Note", **values)
