"""What the commands share: common options, progress reports and messages."""

import argparse
import contextlib
import importlib
import os
import sys
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import TextIO

from ..console import ConsoleProgress, StopSignal
from ..core.errors import EXIT_FAILURE, BadInputError
from ..core.io.formats import MATERIALS, SHAPE
from ..core.settings import PRESETS, Settings
from ..leash import JsonProgress, Leash, MemoryGuard
from ..settings_info import setting_infos


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Add the options on how to read a capture whose folder does not say: one for each field of `Reading`."""
    add = parser.add_argument_group("the capture").add_argument
    layout = "its layout, such as nerfstudio (default: found from what it holds)"
    add("--format", metavar="NAME", default="", help=layout)
    add("--mesh", metavar="FILE", type=Path, help="the mesh, where it is not the format's own")
    add("--outside", action="store_true", help="let its files name others outside of its folder")
    curves = "curve of 8 and 16-bit pictures: srgb, linear, a gamma such as 2.2; auto calibrates them (default)"
    add("--transfer", metavar="CURVE", default="", help=curves)
    add("--exposures", metavar="CSV", type=Path, help="exposure of each frame: lines of name, exposure")
    add("--convention", metavar="NAME", default="", help="a correction of all poses, as `info` proposes it")
    what = f"the mesh's objects: a file of ids (.txt, .csv, .npy, .ply), '{MATERIALS}' or '{SHAPE}' (docs/captures.md)"
    add("--segments", metavar="WHAT", default="", type=_segments, help=what)


def _segments(text: str) -> Path | str:
    return text if text in ("", MATERIALS, SHAPE) else Path(text)


def reading_from(arguments: argparse.Namespace):
    """The `Reading` that the options request."""
    from ..core.io.layout import Reading

    def import_mesh(path: Path):
        return need("data.import_mesh").import_mesh(path)  # only now: most captures need no Blender to be read

    values = {field.name: getattr(arguments, field.name) for field in fields(Reading) if field.compare}
    return Reading(**values, import_mesh=import_mesh)


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add one option for each field of `Settings`."""
    group = parser.add_argument_group("settings")
    text = "what the settings below start from; 'paper' is the published method (default normal)"
    group.add_argument("--preset", choices=tuple(PRESETS), default="normal", help=text)
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


def settings_from(arguments: argparse.Namespace) -> Settings:
    """The chosen preset, changed by the options that were given."""
    given = {info.name: getattr(arguments, info.name) for info in setting_infos()}
    given["without"] = None if arguments.without is None else tuple(arguments.without)
    return replace(PRESETS[arguments.preset], **{name: value for name, value in given.items() if value is not None})


def _add_leash(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("for programs that start a run").add_argument
    lines = "json: one line of JSON for each event instead of text (default text)"
    add("--progress", choices=("text", "json"), default="text", help=lines)
    ends = "stop when standard input says 'stop' or ends, so that the run never outlives its starter"
    add("--stop-with-stdin", action="store_true", help=ends)
    limit = "gigabytes to keep to, by working in smaller blocks; 0 for no limit (default 70 %% of what is free)"
    add("--memory-limit", type=float, metavar="GB", help=limit)


def add_common(parser: argparse.ArgumentParser, function, quiet: bool = True, leash: bool = False) -> None:
    """Add the options of every command, and the `function` that runs it and may return an exit code.

    `quiet` adds --quiet, `leash` what programs that start a run need (see `Leash`).
    """
    if leash:
        _add_leash(parser)
    if quiet:
        parser.add_argument("--quiet", action="store_true", help="print nothing but errors")
    parser.add_argument("--debug", action="store_true", help="also print Blender's messages and tracebacks of errors")
    parser.set_defaults(function=function)


@contextlib.contextmanager
def console_run(arguments: argparse.Namespace, stream: TextIO):
    """The listener and the stop check of a long command, as keyword arguments of `run.progress_of_run`."""
    machine = getattr(arguments, "progress", "text") == "json"
    listener = JsonProgress(stream) if machine else ConsoleProgress(stream, quiet=arguments.quiet)
    guard = MemoryGuard(getattr(arguments, "memory_limit", 0.0), lambda text: os._exit(complain(text, EXIT_FAILURE)))
    leash = Leash() if getattr(arguments, "stop_with_stdin", False) else None
    with StopSignal() as stop:
        try:
            yield {"listener": listener, "should_stop": lambda: guard() or stop() or (leash is not None and leash())}
        finally:
            guard.close()
            listener.close()


def tell_end(
    arguments: argparse.Namespace, stream: TextIO, listener, remarks: Iterable[str], line: str, kind="Warning", **done
) -> None:
    """Report the end of a run and its remarks: as JSON events, the last with the values `done`, or as text."""
    if isinstance(listener, JsonProgress):
        for remark in remarks:
            listener.tell("warning", text=remark)
        listener.tell("done", **done)
    elif not arguments.quiet:
        print(*(f"{kind}: {remark}" for remark in remarks), line, sep="\n", file=stream)


def need(module: str):
    """Import a module of the bridge; raises `BadInputError`, one sentence, where Blender is missing."""
    with needed_packages():
        return importlib.import_module(f"..bridge.{module}", __package__)


@contextlib.contextmanager
def needed_packages():
    """Turn the import error of a required package into a `BadInputError`, one sentence long."""
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
    """Print an error to standard error; returns `code`."""
    with contextlib.suppress(OSError, ValueError):
        print(f"scan-relight: {sentence}", file=sys.stderr, flush=True)
    return code
