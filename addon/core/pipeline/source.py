"""A digest of the source code that a stage is made of, so that what other code has stored is known for old."""

import functools
import hashlib
import re
from pathlib import Path

CORE = Path(__file__).parent.parent  # not resolved: the stages say where they lie as Python found them
IMPORT = re.compile(r"^[ \t]*from (\.+)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)


@functools.cache
def digest(module: Path, root: Path = CORE) -> str:
    """A hash of a module and of all that it imports from below `root`, directly or not.

    It is the same wherever the same source lies, whatever its line ends are.
    """
    modules: set[Path] = set()
    pending = [module]
    while pending:
        path = pending.pop()
        if path not in modules:
            modules.add(path)
            pending += _imported(path, root)
    result = hashlib.sha256()
    for name, path in sorted((path.relative_to(root).as_posix(), path) for path in modules):
        result.update(f"{name}\0{_text(path)}\0".encode())
    return result.hexdigest()


@functools.cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")  # which makes any line end \n


@functools.cache
def _imported(path: Path, root: Path) -> tuple[Path, ...]:
    """The modules below `root` that one imports, and their packages."""
    candidates = []
    for dots, name, imported in IMPORT.findall(_text(path)):
        base = path.parents[len(dots) - 1].joinpath(*filter(None, name.split(".")))
        names = re.findall(r"\w+", re.sub(r" as \w+|#.*", "", imported))
        candidates += [base.with_suffix(".py"), base / "__init__.py", *(base / f"{name}.py" for name in names)]
    return tuple(candidate for candidate in candidates if root in candidate.parents and candidate.is_file())
