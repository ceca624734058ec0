"""Files that are there whole or not at all: written under a temporary name beside the target, then moved over it."""

import contextlib
import os
import secrets
import time
from collections.abc import Iterator
from pathlib import Path

from .errors import StorageError
from .kinds import Shown

TEMPORARY = ".partial-"
"""What a temporary name begins with; the process id follows, so that the remains of dead runs can be recognised."""

HELD_OPEN = os.name == "nt"
"""Whether a file that another program has open can't be replaced: Windows reports a sharing violation."""
PAUSES: Shown[tuple[float, ...]] = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Seconds between one try and the next; scanners let go of a new file after some tenths."""


@contextlib.contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Hand out a temporary path in `path`'s folder; move it over `path` when the block ends well.

    Whatever goes wrong, the temporary file is removed and `path` stays as it was.

    Raises
    ------
    StorageError
        Where the system refuses to write (disk full, read-only, folder gone).
    """
    path = Path(path)
    # Two machines that write into one folder may have the same process id.
    temporary = path.with_name(f"{TEMPORARY}{os.getpid()}-{secrets.token_hex(4)}-{path.name}")
    try:
        try:
            yield temporary
            _move(temporary, path)
        except BaseException:
            with contextlib.suppress(OSError):
                temporary.unlink()
            raise
    except OSError as error:
        raise StorageError(
            f"'{path}' can't be written ({error.strerror or error}); free some space or choose another result folder."
        ) from error


def _move(temporary: Path, path: Path) -> None:
    """Move over what is there; where that may be held open by a virus scanner, try again."""
    for pause in (*PAUSES, None) if HELD_OPEN else (None,):
        try:
            os.replace(temporary, path)
            return
        except PermissionError:
            if pause is None:
                raise
            time.sleep(pause)


def write_bytes(path: Path | str, *pieces: bytes | memoryview) -> None:
    """Write `pieces` one after the other as the content of `path`; raises `StorageError`."""
    with replacing(path) as temporary, open(temporary, "wb") as file:
        for piece in pieces:
            file.write(piece)
        # Without this a machine that loses power may keep the new name and lose the content.
        file.flush()
        os.fsync(file.fileno())
