"""Command to start this add-on's command line as a separate process from within Blender."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[3]
"""The root package's folder, wherever Blender installed it."""
CHILD = """\
import importlib.util, json, os, sys
if hasattr(os, "nice"):
    os.nice(5)
told = json.loads({told})
sys.path[:] = told["path"] + [one for one in sys.path if one not in told["path"]]
spec = importlib.util.spec_from_file_location("scan_relight", told["root"] + "/__init__.py",
                                              submodule_search_locations=[told["root"]])
sys.modules["scan_relight"] = package = importlib.util.module_from_spec(spec)
spec.loader.exec_module(package)
from scan_relight.addon.cli import main
sys.exit(main(told["arguments"]))
"""


def command(arguments: Sequence[str], **options: object) -> list[str]:
    """Program and arguments that run `scan-relight ARGUMENTS`, with an option for each of `options` that is not None.

    In Blender it is Blender itself, without a window and with factory settings, so that no preference, startup file or
    other add-on has an effect; packages are looked for where this process finds them. It has a lower priority.
    """
    arguments = [str(argument) for argument in arguments]
    for name, value in options.items():
        option = name.replace("_", "-")
        if isinstance(value, bool):
            arguments.append(f"--{option}" if value else f"--no-{option}")
        elif value is not None:
            arguments += [f"--{option}", str(value)]
    scripts = bpy.utils.system_resource("SCRIPTS")  # the child's Blender puts them in place itself
    path = [entry for entry in sys.path if isinstance(entry, str) and not (scripts and entry.startswith(scripts))]
    parameters = {"root": ROOT.as_posix(), "path": path, "arguments": arguments}
    code = CHILD.format(told=ascii(json.dumps(parameters)))
    if bpy.app.binary_path:
        flags = "--background --factory-startup -noaudio --python-exit-code 1 --python-expr"
        return [bpy.app.binary_path, *flags.split(), code]
    return [sys.executable, "-c", code]
