"""Which package a function or value comes from, and in which version: what other packages bring is heeded by it."""

import hashlib
import sys
from functools import cache, partial
from importlib.metadata import EntryPoint, packages_distributions, version
from pathlib import Path
from typing import Any

OWN = __name__.removesuffix("core.origin")


def package_of_entry_point(point: EntryPoint) -> str:
    """Name and version of the package that has an entry point."""
    return point.value if point.dist is None else f"{point.dist.name} {point.dist.version}"


def package_of(value: Any) -> str:
    """The same of a function's package, or of a value's class; "" for what is the program's own.

    Of a module that belongs to no package: its name and a hash of its source.
    """
    while isinstance(value, partial):
        value = value.func
    module = getattr(value, "__module__", None) or type(value).__module__
    return "" if module.startswith(OWN) or module == "builtins" else _of_module(module)


@cache
def _of_module(name: str) -> str:
    for package in packages_distributions().get(name.partition(".")[0], ()):
        return f"{package} {version(package)}"
    path = getattr(sys.modules.get(name), "__file__", None)
    return name if path is None else f"{name} {hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]}"
