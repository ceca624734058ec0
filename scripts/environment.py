"""Makes the checkout's own `.venv` from the hashed locks. Needs nothing but Python 3.11 or 3.13 with pip."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOCKS = {(3, 11): "blender-4.5.txt", (3, 13): "blender-5.2.txt"}
TOOLS = "tools.txt"
STAMP = "scan-relight.stamp"


def lock_for(version: tuple[int, int]) -> Path:
    """The lock for a Python; ends the program with one sentence where Blender has none."""
    if version not in LOCKS:
        sys.exit(
            f"This is Python {version[0]}.{version[1]}, but Blender's Python package needs 3.11 or 3.13; "
            f"run it as: python3.11 scripts/{Path(sys.argv[0]).name}"
        )
    return ROOT / "requirements" / LOCKS[version]


def program(folder: Path, name: str) -> Path:
    """Where a virtual environment keeps the program `name`."""
    return folder / ("Scripts" if os.name == "nt" else "bin") / (name + (".exe" if os.name == "nt" else ""))


def stamp_of(locks: list[Path]) -> str:
    """What an environment made of `locks` for this checkout is stamped with."""
    digest = hashlib.sha256(f"{sys.version_info[:3]} {ROOT}".encode())
    for path in (*locks, ROOT / "pyproject.toml", ROOT / "setup.py"):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def prepare(tools: bool = False, folder: Path = ROOT / ".venv") -> Path:
    """Make or complete the environment; quick where nothing has changed.

    Parameters
    ----------
    tools : bool
        Also what the tests need. An environment that has it keeps it.
    folder : Path

    Returns
    -------
    Path
        The environment's Python.
    """
    lock = lock_for(sys.version_info[:2])
    with_tools = [lock, ROOT / "requirements" / TOOLS]
    python, stamp = program(folder, "python"), folder / STAMP
    current = stamp.read_text() if stamp.is_file() and python.exists() else ""
    if current == stamp_of(with_tools) or (current == stamp_of([lock]) and not tools):
        return python
    locks = with_tools if tools else [lock]
    print(
        f"Installing {', '.join(path.name for path in locks)} into {folder.relative_to(ROOT)} "
        "(about 600 MB the first time) ...",
        file=sys.stderr,
        flush=True,
    )
    stamp.unlink(missing_ok=True)
    settings = folder / "pyvenv.cfg"
    if not (current and f"version = {platform.python_version()}\n" in settings.read_text()):
        # Not over one that is good: its Python may be running, and can't be written then.
        venv.create(folder, with_pip=True, clear=True, symlinks=os.name != "nt")
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "--quiet"]
    requirements = [option for path in locks for option in ("-r", str(path))]
    run([*pip, "install", "--no-deps", "--only-binary=:all:", "--require-hashes", *requirements])
    # Building needs setuptools alone, which the lock has just brought; so nothing unpinned is fetched.
    run([*pip, "install", "--no-deps", "--no-build-isolation", "-e", str(ROOT)])
    stamp.write_text(stamp_of(locks))
    return python


def run(command: list[str]) -> None:
    """Run a step of the preparation; ends the program with one sentence where it fails."""
    code = subprocess.run(command, cwd=ROOT).returncode
    if code:
        sys.exit(f"'{' '.join(command[1:4])} ...' failed with exit code {code}; see its message above.")


def hand_over(command: list[str]) -> int:
    """Run the requested program, with Ctrl-C left to it; returns its exit code."""
    process = subprocess.Popen(command, cwd=ROOT)
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            continue


if __name__ == "__main__":
    # For .ci/run: make the environment in the folder that is named and say where its Python is.
    print(prepare(tools=True, folder=ROOT / sys.argv[1]))
