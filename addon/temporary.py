"""A temporary folder for each run, also for Blender's files; the next start removes what killed runs left.

A killed process takes nothing away, and Blender makes a folder for each session. So a run gets a folder that is locked
as long as it lives, in which whoever asks for temporary files puts them. Only folders of this name, of this user, whose
lock is free are taken away.
"""

import atexit
import contextlib
import os
import shutil
import stat
import sys
import tempfile
from pathlib import Path
from typing import IO

NAME = "scan_relight_run_"
LOCK = "lock"
VARIABLES = ("TMPDIR", "TEMP", "TMP")
"""Where programs look for the folder of temporary files."""


class RunFolder:
    """A locked folder for temporary files; `path` is None where none can be made, which is no reason not to run."""

    def __init__(self) -> None:
        self.path: Path | None = None
        self._lock: IO[bytes] | None = None
        base = Path(tempfile.gettempdir())
        take_remains(base)
        with contextlib.suppress(OSError):
            self.path = Path(tempfile.mkdtemp(prefix=NAME, dir=base))
            self._lock = _locked(self.path / LOCK, "xb")

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables that put a process's temporary files there."""
        return {} if self.path is None else dict.fromkeys(VARIABLES, str(self.path))

    def close(self) -> None:
        if self._lock is not None:
            self._lock.close()
        if self.path is not None:
            shutil.rmtree(self.path, ignore_errors=True)


def use_own_folder() -> None:
    """Have this process's temporary files in a folder of its own until it ends; not where Blender has one already."""
    if "bpy" in sys.modules or tempfile.tempdir is not None and NAME in tempfile.tempdir:
        return
    folder = RunFolder()
    if folder.path is not None:
        os.environ.update(folder.environment)
        tempfile.tempdir = str(folder.path)
        atexit.register(folder.close)


def take_remains(base: Path) -> None:
    """Remove the folders of runs that were killed."""
    for folder in base.glob(f"{NAME}*"):
        with contextlib.suppress(OSError):
            status = folder.lstat()
            mine = not hasattr(os, "getuid") or status.st_uid == os.getuid()
            if not (mine and stat.S_ISDIR(status.st_mode) and (folder / LOCK).is_file()):
                continue
            with _locked(folder / LOCK, "r+b"):
                if os.name != "nt":  # there, what is open can't be removed: it can be only where its run has ended
                    shutil.rmtree(folder, ignore_errors=True)
            if os.name == "nt":
                (folder / LOCK).unlink()
                shutil.rmtree(folder, ignore_errors=True)


def _locked(path: Path, mode: str) -> IO[bytes]:
    """The open lock; raises `OSError` where another process has it."""
    file = open(path, mode)
    if os.name != "nt":
        import fcntl

        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.close()
            raise
    return file
