"""A lock on one unit of work that workers on several machines may be given, on storage that knows no locks of its own.

It saves work, no more: what is stored is whole and the same whoever does it, so two who hold it at once, as one of them
was frozen for longer than `patience`, lose time and nothing else.
"""

import contextlib
import json
import os
import secrets
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ..errors import InterruptedRun, StorageError


@dataclass(frozen=True)
class LockParams:
    """How long a lock lives without its owner.

    Attributes
    ----------
    beat : float
        Seconds between two signs of life. NFS clients look at a file anew after 3 to 60 s (acregmin, acregmax), but
        when it is opened.
    patience : float
        Seconds without one after which a lock is lost: of three losses of a minute each, none is of a living owner.
    look : float
        Seconds between two looks at a lock that another has.
    """

    beat: float = 5.0
    patience: float = 180.0
    look: float = 0.5


LOCKS = LockParams()


@contextlib.contextmanager
def held(path: Path, should_stop: Callable[[], bool] = lambda: False, params: LockParams = LOCKS) -> Iterator[None]:
    """Hold the lock at `path`; wait for whoever has it, until it is let go or its owner is dead.

    An owner is dead where it was a process of this machine that is gone, or gives no sign of life for `patience`: its
    counter stands still, by this machine's own clock. What clocks of other machines say is not asked.

    Parameters
    ----------
    path : Path
        In a folder that is there.
    should_stop : callable() -> bool, optional
        Called while another has it.

    Raises
    ------
    InterruptedRun
        From `should_stop`.
    StorageError
        The lock can't be made.
    """
    mine = json.dumps({"machine": machine(), "process": os.getpid(), "token": secrets.token_hex(8)}).encode() + b"\n"
    seen, since = b"", time.monotonic()
    while (file := _make(path, mine)) is None:
        if should_stop():
            raise InterruptedRun("Stopped on request while another worker does this part.")
        content = _read(path)
        if content != seen:
            seen, since = content, time.monotonic()
        if content and _owner_is_gone(content) or time.monotonic() - since > params.patience:
            _take_away(path, content)
        else:
            time.sleep(params.look)
    let_go = threading.Event()
    beating = threading.Thread(target=_beat, args=(file, len(mine), let_go, params.beat), daemon=True)
    beating.start()
    try:
        yield
    finally:
        let_go.set()
        beating.join()
        os.close(file)
        if _read(path).startswith(mine):
            with contextlib.suppress(OSError):
                path.unlink()


def owner(path: Path) -> str:
    """Who holds the lock at `path`, as "host, process 123"; '' where nobody does, or it is known to be gone."""
    content = _read(path)
    entry = _parse(content)
    if not content or _owner_is_gone(content):
        return ""
    return f"{str(entry.get('machine', '?')).split()[0]}, process {entry.get('process', '?')}"


def machine() -> str:
    """This machine and, where known, its boot and its namespace of process ids: within these such an id is unique."""
    parts = [socket.gethostname() or "unnamed"]
    with contextlib.suppress(OSError):
        parts += [Path("/proc/sys/kernel/random/boot_id").read_text().strip(), os.readlink("/proc/self/ns/pid")]
    return " ".join(parts)


def _make(path: Path, content: bytes) -> int | None:
    """The new lock's open file; None where there is one already."""
    try:
        file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
    except OSError as error:
        # Windows refuses what is just being deleted.
        if isinstance(error, FileExistsError) or (isinstance(error, PermissionError) and path.exists()):
            return None
        raise _refused(path, error) from error
    try:
        os.write(file, content)
        os.fsync(file)
    except OSError as error:
        os.close(file)
        path.unlink(missing_ok=True)
        raise _refused(path, error) from error
    return file


def _refused(path: Path, error: OSError) -> StorageError:
    return StorageError(
        f"'{path}' can't be written ({error.strerror or error}); free some space or choose another result folder."
    )


def _beat(file: int, at: int, let_go: threading.Event, seconds: float) -> None:
    """Count on behind the content, in the file itself: a lock that was taken away is not brought back."""
    count = 0
    while not let_go.wait(seconds):
        count += 1
        with contextlib.suppress(OSError):
            os.lseek(file, at, os.SEEK_SET)
            os.write(file, f"{count:012d}".encode())
            os.fsync(file)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


def _parse(content: bytes) -> dict[str, object]:
    try:
        entry = json.loads(content.partition(b"\n")[0])
    except ValueError:
        return {}
    return entry if isinstance(entry, dict) else {}


def _owner_is_gone(content: bytes) -> bool:
    """Whether the owner was a process of this very machine that is there no more."""
    entry = _parse(content)
    process = entry.get("process")
    # Windows' os.kill ends the process that is asked about.
    if sys.platform == "win32" or entry.get("machine") != machine() or " " not in machine():
        return False
    if not isinstance(process, int) or process <= 0:
        return False
    try:
        os.kill(process, 0)
    except OSError as error:
        return isinstance(error, ProcessLookupError)
    return False


def _take_away(path: Path, seen: bytes) -> None:
    """Take away the lock whose content was `seen`; one that another made meanwhile is handed back."""
    aside = path.with_name(f"{path.name}.{secrets.token_hex(8)}")
    with contextlib.suppress(OSError):
        path.rename(aside)
        try:
            if _read(aside) != seen:
                os.link(aside, path)
        finally:
            aside.unlink()
