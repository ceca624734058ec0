"""What the system or one of Blender's operators refuses, in one sentence."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import BadInputError, StorageError


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
