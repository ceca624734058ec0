"""The command line: arguments to settings, errors to exit codes. One program for both homes.

As `scan-relight` in a Python environment with Blender's bpy, and as `blender --command scan_relight` once the
extension is installed. Nothing of Blender or the method is imported before it is needed, so that `--help` is quick.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import os
import sys
import traceback
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TextIO

from .cli_ablation import ablation_command, add_ablation, joined
from .cli_recover import add_reading, add_recover, reading_from, recover_command
from .cli_refit import add_refit, refit_command
from .cli_relight import add_relight, relight_command
from .console import ConsoleProgress, StopWish, own_console, unexpected
from .core.errors import EXIT_BAD_INPUT, EXIT_FAILURE, EXIT_INTERRUPTED, EXIT_OK, BadInputError, ScanRelightError
from .core.settings import PRESETS, Settings
from .leash import JsonProgress, Leash, MemoryGuard
from .settings_info import setting_infos
from .version import VERSION

COMMAND = "scan_relight"
DEMO_SIZES = ("tiny", "small", "large")
EXIT_CODES = """\
exit codes: 0 done, 1 failure, 2 bad input, 130 interrupted (what is finished is kept; the same command goes on from
there)"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments after the program's name; those of this process if not given.

    Returns
    -------
    int
        The exit code: 0 done, 1 failure, 2 bad input, 130 interrupted.
    """
    try:
        arguments = make_parser().parse_args(joined(argv))
    except SystemExit as end:  # argparse has printed help, the version, or what is wrong
        return end.code if isinstance(end.code, int) else EXIT_BAD_INPUT
    try:
        with own_console(keep_others=arguments.debug) as stream:
            return arguments.function(arguments, stream)
    except ScanRelightError as error:
        if arguments.debug:
            traceback.print_exc()
        return complain(str(error), error.exit_code)
    except KeyboardInterrupt:
        return complain("Interrupted; the finished stages are kept.", EXIT_INTERRUPTED)
    except BrokenPipeError:  # whoever read our output has gone
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_FAILURE
    except MemoryError:
        return complain(
            "The memory is used up; a greater --texel-size, a smaller --atlas-size or fewer rays take less.",
            EXIT_FAILURE,
        )
    except Exception as error:  # the last line of defence: a sentence, never a bare traceback
        if arguments.debug:
            traceback.print_exc()
        return complain(unexpected(error, getattr(arguments, "out", None)), EXIT_FAILURE)


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one sentence instead of a page of usage."""

    def error(self, message: str):
        """End with exit code 2."""
        self.exit(EXIT_BAD_INPUT, f"scan-relight: {message[:1].upper()}{message[1:]}; see '{self.prog} --help'.\n")


def make_parser() -> argparse.ArgumentParser:
    """The parser for every command."""
    parser = Parser(
        prog="scan-relight",
        epilog=EXIT_CODES,
        description="Recover albedo, roughness and lamps from a scanned room and write a Blender scene to relight.",
    )
    parser.add_argument("--version", action="version", version=f"scan-relight {VERSION}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    recover = add_recover(commands, EXIT_CODES)
    add_settings(recover)
    add_leash(recover)
    add_common(recover, recover_command)

    info = commands.add_parser(
        "info",
        help="say what a capture holds, and what is wrong with it",
        description="Read and check a capture without recovering anything.",
        epilog=EXIT_CODES,
    )
    info.add_argument("capture", metavar="CAPTURE", type=Path, help="folder of the capture")
    info.add_argument("--json", action="store_true", help="machine-readable")
    info.add_argument("--room", metavar="FOLDER", type=Path, help=argparse.SUPPRESS)
    info.add_argument("--stop-with-stdin", action="store_true", help=argparse.SUPPRESS)
    info.add_argument("--no-look", action="store_true", help="don't compare the frames with the mesh")
    info.add_argument("--overlay", metavar="PNG", type=Path, help="write frames with the mesh's edges drawn over them")
    add_reading(info)
    add_common(info, info_command)

    for add, function in ((add_refit, refit_command), (add_relight, relight_command)):
        command = add(commands, EXIT_CODES)
        add_leash(command)
        add_common(command, function)

    demo = commands.add_parser(
        "demo",
        help="render a small room, recover it, compare, relight",
        epilog=EXIT_CODES,
        description="Render a small furnished room whose materials are known, recover it, print recovered against "
        "true values, and leave scene.blend and before_after.png in RESULT.",
    )
    demo.add_argument("--out", metavar="RESULT", type=Path, required=True, help="folder to write, made if missing")
    demo.add_argument("--size", choices=DEMO_SIZES, default="small", help="number and size of frames (default small)")
    add_settings(demo)
    add_common(demo, demo_command)

    benchmark = commands.add_parser(
        "benchmark",
        help="measure every stage's error and cost against the paper's",
        epilog=EXIT_CODES,
        description="Run each stage over its alternatives, the paper's setting among them, and write a table (CSV and "
        "Markdown) and a plot for each. Errors are the same from run to run; seconds are the machine's.",
    )
    stages = (
        "medians, accumulation, shading, specular or pipeline (default all); or 'ablation ROOM ...', which has --help"
    )
    benchmark.add_argument("stages", metavar="STAGE", nargs="*", help=stages)
    benchmark.add_argument("--capture", metavar="DIR", type=Path, help="also measure on this capture")
    benchmark.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder to write, made if missing")
    benchmark.add_argument("--large", action="store_true", help="the real size; takes much longer")
    benchmark.add_argument("--seed", type=int, metavar="INT", default=0, help="of every random choice (default 0)")
    benchmark.add_argument("--threads", type=int, metavar="INT", default=0, help="0 takes all cores (default 0)")
    add_common(benchmark, benchmark_command)
    add_common(add_ablation(commands, EXIT_CODES), ablation_command)
    return parser


def add_settings(parser: argparse.ArgumentParser) -> None:
    """One option for each field of `Settings`."""
    group = parser.add_argument_group("settings")
    group.add_argument(
        "--preset",
        choices=tuple(PRESETS),
        default="normal",
        help="what the settings below start from; 'paper' is the published method (default normal)",
    )
    for info in setting_infos():
        text = f"{info.help} (default {info.default})".replace("%", "%%")
        option = f"--{info.name.replace('_', '-')}"
        if info.kind is bool:
            group.add_argument(option, action=argparse.BooleanOptionalAction, default=None, help=text)
        elif info.choices:
            group.add_argument(option, choices=info.choices, help=text)
        else:
            group.add_argument(option, type=info.kind, metavar=info.kind.__name__.upper(), help=text)
    text = "leave a pass out, to see what it does; can be repeated (names: benchmark ablation --list)"
    group.add_argument("--without", metavar="PASS", action="append", help=text)


def add_leash(parser: argparse.ArgumentParser) -> None:
    """Options for programs that start a run and follow it."""
    group = parser.add_argument_group("for programs that start a run")
    group.add_argument(
        "--progress",
        choices=("text", "json"),
        default="text",
        help="json: one line of JSON for each event instead of text (default text)",
    )
    group.add_argument(
        "--stop-with-stdin",
        action="store_true",
        help="stop when standard input says 'stop' or ends, so that the run never outlives its starter",
    )
    group.add_argument(
        "--memory-limit",
        type=float,
        metavar="GB",
        default=0.0,
        help="stop when the run takes more gigabytes (default 0, no limit)",
    )


def add_common(parser: argparse.ArgumentParser, function) -> None:
    """Options of every command, and what runs it."""
    if function is not info_command:
        parser.add_argument("--quiet", action="store_true", help="print nothing but errors")
    parser.add_argument("--debug", action="store_true", help="also print Blender's messages and tracebacks of errors")
    parser.set_defaults(function=function)


def settings_from(arguments: argparse.Namespace) -> Settings:
    """The preset with everything that was given."""
    given = {info.name: getattr(arguments, info.name) for info in setting_infos()}
    given["without"] = None if arguments.without is None else tuple(arguments.without)
    return replace(PRESETS[arguments.preset], **{name: value for name, value in given.items() if value is not None})


@contextlib.contextmanager
def console_run(arguments: argparse.Namespace, stream: TextIO):
    """The listener and the wish to stop of a long command, as keywords of `run.progress_for`."""
    machine = getattr(arguments, "progress", "text") == "json"
    listener = JsonProgress(stream) if machine else ConsoleProgress(stream, quiet=arguments.quiet)
    guard = MemoryGuard(getattr(arguments, "memory_limit", 0.0), lambda text: os._exit(complain(text, EXIT_FAILURE)))
    leash = Leash() if getattr(arguments, "stop_with_stdin", False) else None
    with StopWish() as wish:
        try:
            yield {"listener": listener, "should_stop": lambda: guard() or wish() or (leash is not None and leash())}
        finally:
            guard.close()
            listener.close()


def demo_command(arguments: argparse.Namespace, stream: TextIO) -> int:
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
    return EXIT_OK


def benchmark_command(arguments: argparse.Namespace, stream: TextIO) -> int:
    """`benchmark [STAGE ...] --out DIR`."""
    if arguments.seed < 0 or arguments.threads < 0:
        raise BadInputError("Options --seed and --threads take whole numbers of at least 0.")
    with needed_packages():
        from .benchmark.run import NO_PLOTS, Options, check_stages, plots_are_possible, run_benchmark
        from .core.progress import Progress

        stages = check_stages(arguments.stages)
        with console_run(arguments, stream) as console:
            progress = Progress(weights=dict.fromkeys(stages, 1.0), **console)
            options = Options(
                arguments.capture, arguments.large, arguments.seed, arguments.threads, arguments.out, progress
            )
            results = run_benchmark(stages, options)
    if not arguments.quiet:
        for stage, tables in results.items():
            if isinstance(tables, str):
                print(f"Skipped {stage}: {tables}", file=stream)
            else:
                print(*(table.markdown() for table in tables), sep="\n", file=stream)
        if not plots_are_possible():
            print(NO_PLOTS, file=stream)
        print(f"Tables and plots: {arguments.out / 'index.md'}", file=stream)
    return EXIT_OK


def info_command(arguments: argparse.Namespace, stream: TextIO) -> int:
    """`info CAPTURE`."""
    from .core.io.read import describe, read_capture

    if arguments.stop_with_stdin:
        Leash(grace=0.0)
    capture = read_capture(arguments.capture, reading_from(arguments))
    if arguments.room is not None:
        from .core.results.room_file import write_room

        write_room(arguments.room, capture)
    facts = describe(capture)
    if capture.frames and not arguments.no_look:
        facts["agreement"] = compare(capture, arguments)
    if arguments.json:
        print(json.dumps(facts, indent=1), file=stream)
        return EXIT_OK
    extent = " x ".join(f"{length:.2f}" for length in facts["extent_m"])
    sizes = ", ".join(f"{count} of {size}" for size, count in facts["resolutions"].items())
    lenses = ", ".join(f"{count} of {name}" for name, count in facts["lenses"].items())
    lenses = f"; lenses: {lenses}" if set(facts["lenses"]) - {"PINHOLE"} else ""
    print(f"{facts['capture']} ({facts['format']})", file=stream)
    told = f": {sizes} pixels; {facts['masks']} with a mask{lenses}" if facts["frames"] else ""
    print(f"  frames     {facts['frames']}{told}", file=stream)
    print(
        f"  mesh       {facts['triangles']} triangles, {facts['vertices']} vertices, {facts['area_m2']:.1f} m2, "
        f"{extent} m",
        file=stream,
    )
    print(f"  instances  {len(facts['instances'])}", file=stream)
    for one in facts["instances"]:
        print(f"    {one['object_id']:>5}  {one['class_name']:<24} {one['triangles']:>8} triangles", file=stream)
    for warning in facts["warnings"]:
        print(f"  warning    {warning}", file=stream)
    for sentence in facts.get("agreement", {}).get("sentences", ()):
        print(f"  poses      {sentence}", file=stream)
    return EXIT_OK


def compare(capture, arguments: argparse.Namespace) -> dict:
    """Whether frames and mesh fit, ready for JSON; writes the overlay where one is wanted."""
    with needed_packages():
        from .core.agreement.look import look
        from .core.agreement.overlay import overlay
        from .core.atomic import write_bytes
        from .core.io.conventions import Convention
        from .core.io.pixels import read_pixels
        from .core.io.png import png

        found = look(capture, read_pixels, search=not arguments.convention)
        if arguments.overlay is not None:
            columns = [Convention()] + ([found.best.convention] if found.best else [])
            write_bytes(arguments.overlay, png(overlay(capture, read_pixels, columns)))
    return {
        "fits": found.fits,
        "quality": found.as_read.quality,
        "hit": found.as_read.hit,
        "convention": str(found.best.convention) if found.best else None,
        "misaligned_pixels": found.misaligned.round(3).tolist(),
        "sentences": found.sentences(),
    }


def need(module: str):
    """A module of the bridge; where there is no Blender, say so in one sentence."""
    with needed_packages():
        return importlib.import_module(f".bridge.{module}", __package__)


@contextlib.contextmanager
def needed_packages():
    """Turn the absence of a package that the method needs into one sentence."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name and error.name.split(".")[0] in ("bpy", "numpy", "scipy", "embreex", "OpenEXR"):
            how = "pip install 'scan-relight[blender]'" if error.name == "bpy" else "pip install scan-relight"
            raise BadInputError(
                f"The Python package '{error.name}' is missing; {how} brings it"
                f"{'; recover --no-scene does without' if error.name == 'bpy' else ''}."
            ) from error
        raise


def complain(sentence: str, code: int) -> int:
    """Say what went wrong on standard error; returns `code`."""
    with contextlib.suppress(OSError, ValueError):
        print(f"scan-relight: {sentence}", file=sys.stderr, flush=True)
    return code


_handle = None


def register() -> None:
    """Make `blender --command scan_relight` known."""
    global _handle
    import bpy

    _handle = bpy.utils.register_cli_command(COMMAND, main)


def unregister() -> None:
    """Take the command back."""
    global _handle
    import bpy

    if _handle is not None:
        bpy.utils.unregister_cli_command(_handle)
        _handle = None
