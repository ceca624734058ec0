"""What the system or one of Blender's operators refuses, and what is to be said of objects, in one sentence each."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import BadInputError, StorageError
from ..core.kinds import Shown

MAX_TOLD: Shown[int] = 3


def reason_of(error: Exception) -> str:
    """Why, in a line: the system's word, or an operator's without what Blender puts around it."""
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
    part = folder.with_name(folder.name + ".part")
    try:
        with refused(what, "free some space or choose another folder", BadInputError):  # what was written is cut off
            shutil.rmtree(part, ignore_errors=True)
            part.mkdir(parents=True)
            yield part
            shutil.rmtree(folder, ignore_errors=True)
            os.replace(part, folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def sentences(*told: tuple[list[str], str]) -> tuple[str, ...]:
    """One on all objects of which the same is to be said, by their names; none where there are none."""
    return tuple(f"{_few(names)}: {what}." for names, what in told if names)


def _few(names: list[str]) -> str:
    """The objects of these names, for a sentence: the first ones, and how many more."""
    shown = ", ".join(f"'{name}'" for name in names[:MAX_TOLD])
    return (
        f"Objects {shown} and {len(names) - MAX_TOLD} more"
        if len(names) > MAX_TOLD
        else f"Object{'s' if len(names) > 1 else ''} {shown}"
    )
