"""Paths that a capture's files name: within its folder, unless the user allows more."""

from __future__ import annotations

from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from ..errors import BadInputError
from ..scene.model import Frame


class EscapesError(BadInputError):
    """A path leads out of the capture's folder: no slip of one frame, so it is told at once."""


def absence(path: Path) -> str:
    """Why no file can be read at `path`, as the end of a sentence; '' where one can: pipes and devices never end."""
    return "" if path.is_file() else "is not a file" if path.exists() else "does not exist"


def inside(root: Path, value: Any, name: str, outside: bool = False, folder: Path | None = None) -> Path:
    """What a file calls `value`, as a path.

    Parameters
    ----------
    root : Path
        The capture.
    name : str
        The frame, for messages.
    outside : bool
        Whether the path may lead out of `root`.
    folder : Path, optional
        What `value` is relative to, where not `root`.

    Raises
    ------
    BadInputError
        `value` is no path.
    EscapesError
        It leads out of the capture.
    """
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise BadInputError(f"Frame '{name}' names no picture; give its file_path.")
    if not outside:
        # Both ways of writing paths: a capture made on the other system must not lead out either.
        for kind in (PurePosixPath, PureWindowsPath):
            path = kind(value)
            if path.is_absolute() or path.drive or path.root or ".." in path.parts:
                raise EscapesError(
                    f"Frame '{name}' has the path '{value}', which leads out of the capture '{root}'; "
                    "give paths within it, or allow others with --outside."
                )
    if PureWindowsPath(value).drive:  # written on Windows: there alone it may lead anywhere
        return Path(value)
    return (folder or root) / PurePosixPath(value.replace("\\", "/"))


def check_links(root: Path, frame: Frame) -> None:
    """Look where the links among a frame's files lead.

    Raises
    ------
    EscapesError
        A file that lies in the capture by its name lies outside by a link.
    """
    for path in frame.files:
        if not path.is_relative_to(root):
            continue
        try:
            inside_root = path.resolve().is_relative_to(root.resolve())
        except (OSError, RuntimeError, ValueError):  # a loop, or a name that can't be: told when it is read
            continue
        if not inside_root:
            raise EscapesError(
                f"Frame '{frame.name}': '{path}' is a link or lies behind one that leads out of the "
                f"capture '{root}'; allow that with --outside."
            )
