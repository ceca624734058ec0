"""Which folder a capture's result goes to, so that no two captures ever share one, and nothing of the user's is hit.

A result is the artist's work. It lies where her documents lie, never in a folder that someone else clears.
"""

import json
import os
import re
import sys
from itertools import count
from pathlib import Path

from ..atomic import write_bytes
from .room_file import DAMAGE, root_of

CAPTURE = "capture.json"
"""File of a result folder that tells which capture it is of, from the first moment of a run on."""
DOCUMENTS_FOLDER = "Scan Relight"
FOLDER_BESIDE = "scan relight"
"""Folders of results: among the user's documents; beside a saved .blend."""


def write_capture(folder: Path | str, capture: Path | str) -> None:
    """Write `CAPTURE` into a result folder; raises `StorageError`."""
    folder, capture = Path(folder).absolute(), Path(capture).absolute()
    try:
        relative = Path(os.path.relpath(capture, folder)).as_posix()
    except ValueError:  # another drive
        relative = ""
    entry = {"folder": str(capture), "relative": relative}
    write_bytes(folder / CAPTURE, json.dumps(entry, indent=1, ensure_ascii=False).encode() + b"\n")


def captures(folder: Path | str) -> tuple[Path, ...]:
    """Where the capture of a result folder may lie: at its absolute path, and beside the result as it was then.

    The second holds where a project's folder was moved as a whole. Empty where the folder is no result.
    """
    folder = Path(folder)
    try:
        entry = json.loads((folder / CAPTURE).read_text(encoding="utf-8"))
        paths = [Path(entry["folder"])]
        if entry.get("relative"):
            paths.append(Path(os.path.normpath(folder.absolute() / entry["relative"])))
        return tuple(paths)
    except DAMAGE:
        pass
    root = root_of(folder)  # of an earlier version
    return () if root is None else (root,)


def own_folder(parent: Path | str, capture: Path | str) -> Path:
    """The folder below `parent` that is a capture's own: its name, or "name 2" and so on where others have that.

    It is the one that holds the capture's result already, or else does not exist or is empty; it is not made here.
    """
    capture = Path(capture).absolute()
    folders = _numbered(Path(parent), capture.name or "room")
    return next(folder for folder in folders if is_free(folder) or capture in captures(folder))


def free_folder(parent: Path | str, name: str) -> Path:
    """The first of "name", "name 2", ... below `parent` that does not exist or is empty."""
    return next(filter(is_free, _numbered(Path(parent), name)))


def is_free(folder: Path) -> bool:
    """Whether there is nothing in a folder."""
    try:
        with os.scandir(folder) as entries:
            return next(entries, None) is None
    except FileNotFoundError:
        return True
    except OSError:
        return False


def _numbered(parent: Path, name: str):
    return (parent / (name if number == 1 else f"{name} {number}") for number in count(1))


def documents() -> Path:
    """The user's folder of documents as the system tells it, or the home folder."""
    home = Path.home()
    for folder in (_known_folder(), _xdg(home), home / "Documents"):
        if folder is not None and folder.is_dir():
            return folder
    return home


def _xdg(home: Path) -> Path | None:
    """What the desktop's settings say (Linux): `XDG_DOCUMENTS_DIR` in user-dirs.dirs."""
    settings = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config") / "user-dirs.dirs"
    try:
        match = re.search(r'^\s*XDG_DOCUMENTS_DIR="(.+)"\s*$', settings.read_text(encoding="utf-8"), re.MULTILINE)
    except (OSError, ValueError):
        return None
    return Path(match[1].replace("$HOME", str(home))) if match else None


def _known_folder() -> Path | None:
    """What Windows' registry says: the folder may lie on another drive or in a synchronised one."""
    if sys.platform != "win32":
        return None
    import winreg

    subkey = r"Software\Microsoft\Windows\CurrentVersion\Explorer\User Shell Folders"
    try:
        with winreg.OpenKey(winreg.HKEY_CURRENT_USER, subkey) as key:
            return Path(os.path.expandvars(winreg.QueryValueEx(key, "Personal")[0]))
    except OSError:
        return None
