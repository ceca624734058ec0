"""What the system or one of Blender's operators refuses, and remarks on objects, in one sentence each."""

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import BadInputError, StorageError
from ..core.kinds import Shown

MAX_LISTED: Shown[int] = 3


def reason_of(error: Exception) -> str:
    """The reason in one line: the system's message, or an operator's without what Blender puts around it."""
    return " ".join(str(getattr(error, "strerror", None) or error).split()).removeprefix("Error: ").rstrip(".")


@contextmanager
def refused(what: str, advice: str, *also: type[Exception]) -> Iterator[None]:
    """Raise a `StorageError` for what is refused within, or raises one of `also`: "`what` (the reason); `advice`."."""
    try:
        yield
    except (OSError, RuntimeError, *also) as error:
        raise StorageError(f"{what} ({reason_of(error)[:300]}); {advice}.") from error


@contextmanager
def whole_folder(folder: Path, what: str) -> Iterator[Path]:
    """Hand out an empty folder beside `folder` that takes its place at the end; raises as `refused`."""
    partial = folder.with_name(folder.name + ".part")
    try:
        with refused(what, "free some space or choose another folder", BadInputError):  # what was written is cut off
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir(parents=True)
            yield partial
            shutil.rmtree(folder, ignore_errors=True)
            os.replace(partial, folder)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def check_backslash(folder: Path, advice: str) -> None:
    """Raise `BadInputError` for a folder to write with a backslash in its path, which Blender takes for a slash."""
    if os.sep == "/" and "\\" in str(folder.absolute()):
        what = "has a backslash in its path, which Blender takes for a slash"
        raise BadInputError(f"Result folder '{folder.absolute()}' {what}; {advice}.")


def sentences(*remarks: tuple[list[str], str]) -> tuple[str, ...]:
    """One sentence for each remark, naming all objects that it is about; remarks without objects are left out."""
    return tuple(f"Object{'s' if len(names) > 1 else ''} {listed(names)}: {what}." for names, what in remarks if names)


def listed(names: Sequence[str]) -> str:
    """Names for a sentence: the first ones, and how many more."""
    omitted = f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    return ", ".join(f"'{name}'" for name in names[:MAX_LISTED]) + omitted
