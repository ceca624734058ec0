"""The command line: arguments to settings, errors to exit codes. The same program in both environments.

As `scan-relight` in a Python environment with Blender's bpy, and as `blender --command scan_relight` once the
extension is installed. Nothing of Blender or the method is imported before it is needed, so that `--help` is quick.
"""

import argparse
import contextlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from ..console import own_console, unexpected
from ..core.errors import EXIT_BAD_INPUT, EXIT_FAILURE, EXIT_INTERRUPTED, EXIT_OK, ScanRelightError, check_path
from ..core.memory import give_back_at_once
from ..core.parallel import ONE_BLAS_THREAD
from ..temporary import use_own_folder
from ..version import VERSION
from .ablation import add_ablation, joined
from .benchmark import add_benchmark
from .common import complain
from .demo import add_demo
from .info import add_info
from .recover import add_recover
from .refit import add_refit
from .relight import add_relight

COMMAND = "scan_relight"
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
    os.environ.update(ONE_BLAS_THREAD | os.environ)
    give_back_at_once()
    use_own_folder()
    try:
        for value in vars(arguments).values():
            for path in value if isinstance(value, list) else [value]:
                if isinstance(path, Path):
                    check_path(path)
        with own_console(keep_others=arguments.debug) as stream:
            return arguments.function(arguments, stream) or EXIT_OK
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
    """A parser that documents the exit codes, and reports a mistake in one sentence instead of a page of usage."""

    def __init__(self, *args, **options):
        super().__init__(*args, epilog=EXIT_CODES, **options)

    def error(self, message: str):
        """End with exit code 2."""
        self.exit(EXIT_BAD_INPUT, f"scan-relight: {message[:1].upper()}{message[1:]}; see '{self.prog} --help'.\n")


def make_parser() -> argparse.ArgumentParser:
    """The parser for every command."""
    parser = Parser(
        prog="scan-relight",
        description="Recover albedo, roughness and lamps from a scanned room and write a Blender scene to relight.",
    )
    parser.add_argument("--version", action="version", version=f"scan-relight {VERSION}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for add in (add_recover, add_info, add_refit, add_relight, add_demo, add_benchmark, add_ablation):
        add(commands)
    if importlib.util.find_spec("..farm", __package__):  # the extension's zip has none
        from ..farm.commands import add_farm
        from ..farm.divide import add_divide
        from ..farm.join import add_join

        add_farm(commands)
        add_divide(commands)
        add_join(commands)
    return parser


_handle = None


def register() -> None:
    """Make `blender --command scan_relight` known."""
    global _handle
    import bpy

    _handle = bpy.utils.register_cli_command(COMMAND, main)


def unregister() -> None:
    """Unregister the command."""
    global _handle
    import bpy

    if _handle is not None:
        bpy.utils.unregister_cli_command(_handle)
        _handle = None
