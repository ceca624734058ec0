"""Reading files of a capture safely, and only within its folder unless the user allows more."""

import json
import mmap
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from ..errors import BadInputError
from ..kinds import Limit

MAX_TEXT: Limit[int] = 1 << 28
"""Bytes of a table of poses or cameras."""


class EscapesError(BadInputError):
    """A path leads out of the capture's folder: not one frame's mistake, so it is reported at once."""


def absence(path: Path) -> str:
    """Why no file can be read at `path`, as the end of a sentence; '' where one can: pipes and devices never end."""
    return "" if path.is_file() else "is not a file" if path.exists() else "does not exist"


def check_picture(path: Path) -> None:
    """Raise `BadInputError` where no picture can be read at `path`."""
    if reason := absence(path):
        raise BadInputError(f"Picture '{path}' {reason}; check the capture's paths.")


@contextmanager
def readable(what: str, remedy: str = "check the file and its rights") -> Iterator[None]:
    """Turn an `OSError` while `what` is read into a `BadInputError`, one sentence long."""
    try:
        yield
    except OSError as error:
        raise BadInputError(f"{what} can't be read ({error.strerror or error}); {remedy}.") from error


def read_bytes(path: Path, what: str = "", max_bytes: int = -1) -> bytes:
    """A file's content, or the first `max_bytes` bytes of it; errors name it as `what` 'path'."""
    with readable(f"{what}'{path}'"), open(path, "rb") as file:
        return file.read(max_bytes)


@contextmanager
def mapped(path: Path) -> Iterator[mmap.mmap]:
    """A file's content, of which only what is looked at is read; raises OSError, and ValueError where it is empty."""
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        yield data


def _content(path: Path) -> str:
    """The text of `path`; a ValueError where it is none, a `BadInputError` where it can't be read or is too large."""
    with readable(f"'{path}'", "check the capture"):
        if reason := absence(path):
            raise BadInputError(f"'{path}' {reason}; check the capture.")
        if path.stat().st_size > MAX_TEXT:
            raise BadInputError(f"'{path}' is too large for a table of a capture; export it again.")
        return path.read_text(encoding="utf-8-sig")


def read_text(path: Path) -> str:
    """A table of poses or cameras; raises `BadInputError` where it is absent, no text, or larger than any such."""
    try:
        return _content(path)
    except ValueError as error:
        raise BadInputError(f"'{path}' is no text; export it again.") from error


def read_json(path: Path) -> dict[str, Any]:
    """The object in the file `path`; raises `BadInputError` where it is absent, not JSON, or no object."""
    try:
        value = json.loads(_content(path))
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"'{path}' is not valid JSON ({error}); export it again.") from error
    if not isinstance(value, dict):
        raise BadInputError(f"'{path}' holds no JSON object; export it again.")
    return value


def json_if_sound(path: Path) -> dict[str, Any]:
    """The object in the JSON file `path`; empty where it is absent, can't be read, or holds something else."""
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def leads_out(name: str) -> bool:
    """Whether a path is absolute or holds '..', as either kind of system writes it: captures travel between them."""
    kinds = PurePosixPath(name), PureWindowsPath(name)
    return any(kind.is_absolute() or kind.drive or kind.root or ".." in kind.parts for kind in kinds)


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
        `value` is no path, or one that no file can have.
    EscapesError
        It leads out of the capture.
    """
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise BadInputError(f"Frame '{name}' names no picture; give its file_path.")
    if not outside and leads_out(value):
        raise EscapesError(
            f"Frame '{name}' has the path '{value}', which leads out of the capture '{root}'; "
            "give paths within it, or allow others with --outside."
        )
    path = (folder or root) / PurePosixPath(value.replace("\\", "/"))
    if PureWindowsPath(value).drive:  # written on Windows: there alone it may lead anywhere
        path = Path(value)
    try:
        path.is_file()
    except OSError as error:  # a name longer than any file's, a folder that nobody may look into
        raise BadInputError(f"The path of frame '{name}' can't be looked up ({error.strerror}); mend it.") from error
    return path


def check_links(root: Path, name: str, files: Iterable[Path]) -> None:
    """Raise `EscapesError` where a file of frame `name` lies in the capture by its name and outside by a link."""
    for path in files:
        if not path.is_relative_to(root):
            continue
        try:
            inside_root = path.resolve().is_relative_to(root.resolve())
        except (OSError, RuntimeError, ValueError):  # a loop, or a name that can't be: told when it is read
            continue
        if not inside_root:
            raise EscapesError(
                f"Frame '{name}': '{path}' is a link or lies behind one that leads out of the "
                f"capture '{root}'; allow that with --outside."
            )
