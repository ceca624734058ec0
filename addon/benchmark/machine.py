"""What a benchmark ran on, in words that name neither the host nor a path."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import sys
from pathlib import Path

from ..core.parallel import thread_count
from ..version import VERSION


def describe_machine() -> dict[str, str]:
    """Processor, cores, memory, system and versions; what can't be found out is left out."""
    found = {
        "processor": _processor(),
        "cores": str(thread_count(0)),
        "memory": _memory(),
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
        **{name: _version(package) for name, package in (("NumPy", "numpy"), ("embreex", "embreex"))},
        "Blender": _blender(),
        "Scan Relight": VERSION,
    }
    return {name: text for name, text in found.items() if text}


def _processor() -> str:
    """The processor's model."""
    try:
        if sys.platform == "linux":
            lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
            names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
            return names[0] if names else platform.machine()
        if sys.platform == "darwin":
            command = ["sysctl", "-n", "machdep.cpu.brand_string"]
            return subprocess.run(command, capture_output=True, text=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        pass
    return platform.processor() or platform.machine()


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


def _blender() -> str:
    """Blender's version: of the one we run in, else of pip's bpy, which need not be loaded for that."""
    bpy = sys.modules.get("bpy")
    return bpy.app.version_string if bpy is not None else _version("bpy")
