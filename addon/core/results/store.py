"""The result folder: which stages are finished, under which key, and files that are there whole or not at all.

A stage's key is made of those of the stages that it takes, of the settings that it heeds and of its source
(`pipeline.stage`). So a changed setting makes its own stage and all later ones anew, and nothing else.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import secrets
import shutil
import sys
from collections.abc import Container, Iterable
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from ..atomic import TEMPORARY, write_bytes
from ..errors import BadInputError, StorageError
from ..json_values import plain
from .archive import Damaged, read_archive, write_archive

STAGES = "stages"
STAGE_FILE = r"[A-Za-z0-9_-]+\.npz"
SPILLED = "tmp-observations-"
"""How folders begin that an exact median keeps its observations in (`lit_diffuse.medians`)."""
OTHERS = ("objects", "kept")
"""Further folders of a result: images of single objects, images that saved files show."""
LOCK = ".lock"
FULL = (errno.ENOSPC, errno.EDQUOT if hasattr(errno, "EDQUOT") else errno.ENOSPC)


class Store:
    """The folder that a run writes its stages and results to. One run at a time; close it, or use `with`.

    Parameters
    ----------
    folder : path
        Made where absent.
    shared : bool
        Others who open it so may have it at the same time: for workers of whom each writes a stage's part of its own.

    Attributes
    ----------
    damaged : list of str
        Stages that were asked for and found damaged or changed.

    Raises
    ------
    BadInputError
        The folder can't be made or written, or another run is writing it.
    StorageError
        The disk is full.
    """

    def __init__(self, folder: Path | str, shared: bool = False):
        self.folder = Path(folder)
        self.damaged: list[str] = []
        self._lock = None
        for name in (STAGES, *OTHERS):
            if (self.folder / name).is_symlink():
                raise BadInputError(
                    f"'{self.folder / name}' is a link, and a run would write elsewhere; put a folder in its place."
                )
        try:
            (self.folder / STAGES).mkdir(parents=True, exist_ok=True)
            self._lock = _take_lock(self.folder, shared)
            if not shared:
                self._clear()
            probe = self.folder / f"{TEMPORARY}{os.getpid()}-{secrets.token_hex(4)}-probe"
            probe.write_bytes(b"probe")
            probe.unlink()
        except OSError as error:
            self.close()
            reason = error.strerror or error
            if error.errno in FULL:
                raise StorageError(
                    f"Result folder '{self.folder}' can't be written ({reason}); free some space or choose another."
                ) from error
            if isinstance(error, (FileExistsError, NotADirectoryError)):
                raise BadInputError(
                    f"Result folder '{self.folder}' can't be made: a file is in its way; choose another."
                ) from error
            raise BadInputError(
                f"Result folder '{self.folder}' can't be written ({reason}); choose one that you may write."
            ) from error

    def _clear(self) -> None:
        """Remove what dead runs left: with the lock held by us alone, whoever wrote it is dead."""
        for where in (self.folder, self.folder / STAGES):
            for remains in where.glob(f"{TEMPORARY}*"):
                remains.unlink()
        for remains in self.folder.glob(f"{SPILLED}*"):
            shutil.rmtree(remains, ignore_errors=True)

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Let other runs have the folder."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def path(self, name: str) -> Path:
        """Where the result `name` (which may hold '/') lies."""
        if PurePath(name).is_absolute() or ".." in PurePath(name).parts:
            raise ValueError(f"'{name}' leads out of the result folder")
        return self.folder / name

    def load(self, name: str, key: str) -> dict[str, np.ndarray] | None:
        """The arrays of stage `name`; None where it is absent, was made under another key, or is damaged."""
        if self.stored_key(name) != key:
            return None
        stored = self._read(name, None)
        return None if stored is None else stored[1]

    def load_meta(self, name: str, key: str) -> dict[str, Any] | None:
        """What `save` was given as `meta`; None as for `load`."""
        return self.stored_meta(name) if self.stored_key(name) == key else None

    def stored_meta(self, name: str) -> dict[str, Any]:
        """What the stage `name` was stored with as `meta`, under whatever key; empty where it is absent or damaged."""
        stored = self._read(name, ())
        return stored[0]["meta"] if stored else {}

    def stored_key(self, name: str) -> str | None:
        """The key under which the stage `name` is stored; None where it is absent or damaged."""
        stored = self._read(name, ())
        return stored[0]["key"] if stored else None

    def _read(self, name: str, wanted: Container[str] | None) -> tuple[dict[str, Any], dict[str, np.ndarray]] | None:
        """A stage's archive; None where it is absent, or damaged, which is noted."""
        try:
            return read_archive(self._stage(name), wanted)
        except FileNotFoundError:
            return None
        except Damaged:
            if name not in self.damaged:
                self.damaged.append(name)
            return None

    def save(self, name: str, key: str, arrays: dict[str, np.ndarray], meta: dict[str, Any] | None = None) -> None:
        """Store the finished stage `name`, in whole or not at all; raises as `archive.write_archive`."""
        write_archive(self._stage(name), arrays, {"key": key, "meta": meta or {}})

    def parts(self, name: str) -> list[str]:
        """Names under which parts of the stage `name` are stored, under whatever key."""
        return sorted(path.stem for path in (self.folder / STAGES).glob(f"{name}-*-of-*.npz"))

    def drop(self, names: Iterable[str]) -> None:
        """Forget the stages `names`, so that they are done again; one that is not stored is no error."""
        for name in names:
            self._stage(name).unlink(missing_ok=True)

    def write_json(self, name: str, value: Any) -> Path:
        """Write the result `name`; NaN and inf, which JSON lacks, become null. Raises `StorageError`."""
        path = self._parent(name)
        write_bytes(path, json.dumps(plain(value), indent=1, ensure_ascii=False).encode() + b"\n")
        return path

    def write_exr(self, name: str, array: np.ndarray, half: bool = False) -> Path:
        """Write the picture `name` (row 0 = top); see `io.exr.write_exr`. Raises `StorageError`."""
        from ..io.exr import write_exr  # not earlier: Blender's start, which knows the store, waits for no library

        path = self._parent(name)
        write_exr(path, array, half)
        return path

    def _parent(self, name: str) -> Path:
        path = self.path(name)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StorageError(
                f"'{path.parent}' can't be made ({error.strerror or error}); choose another result folder."
            ) from error
        return path

    def _stage(self, name: str) -> Path:
        if not re.fullmatch(STAGE_FILE, f"{name}.npz"):
            raise ValueError(f"'{name}' is no name for a stage")
        return self.folder / STAGES / f"{name}.npz"


def _take_lock(folder: Path, shared: bool = False):
    """Lock `folder`, against all others or those alone that don't share it; returns the open lock file.

    The system frees it when it is closed or its process dies, so a run that was killed leaves none behind.
    """
    # A link in a folder that somebody else made must not have its target emptied.
    no_link = getattr(os, "O_NOFOLLOW", 0)
    file = open(folder / LOCK, "a+b", opener=lambda path, flags: os.open(path, flags | no_link, 0o666))
    try:
        if sys.platform == "win32":
            import msvcrt

            file.seek(1 << 20)  # far behind the content: Windows won't let others read what is locked
            if not shared:  # it knows no shared ones
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EAGAIN, errno.EACCES, errno.EDEADLK):
            file.seek(0)
            owner = file.read(20).decode("ascii", "replace")
            file.close()
            raise BadInputError(
                f"Result folder '{folder}' is being written by another run (process {owner}); "
                "wait for it or choose another folder."
            ) from error
        # Some network disks know no locks; a run there is worth more than the protection.
    with contextlib.suppress(OSError):
        file.truncate(0)
        file.write(str(os.getpid()).encode())
        file.flush()
    return file
