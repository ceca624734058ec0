"""What a benchmark ran on, in words that name neither the host nor a path."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import sys
from pathlib import Path

from ..core.parallel import thread_count
from ..version import VERSION


def describe_machine() -> dict[str, str]:
    """Processor, cores, memory, system and versions; what can't be found out is left out."""
    bpy = sys.modules.get("bpy")
    found = {
        "processor": _processor(),
        "cores": str(thread_count(0)),
        "memory": _memory(),
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
        "NumPy": _version("numpy"),
        "embreex": _version("embreex"),
        "Blender": bpy.app.version_string if bpy is not None else _version("bpy"),
        "Scan Relight": VERSION,
    }
    return {name: text for name, text in found.items() if text}


def _processor() -> str:
    """The processor's model, where the system has it in a file; else its kind."""
    try:
        named = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(errors="replace"), re.MULTILINE)
    except OSError:
        named = None
    return named[1] if named else platform.processor() or platform.machine()


def _memory() -> str:
    try:
        return f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.0f} GiB"
    except (AttributeError, OSError, ValueError):  # Windows has no sysconf
        return ""


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""
