"""A folder of result folders: how much they take, and clearing them away. Touches nothing that `Store` did not make."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from .errors import ScanRelightError
from .store import LOCK, STAGES, Store

SCENE, REPORT = "scene.blend", "report.json"
SAVED_AGAIN = 2.0
"""Seconds after the report from which on a scene.blend was saved by its user: a run writes the report last."""


@dataclass(frozen=True)
class Cleared:
    """What was cleared: bytes that are free again, how many results were touched, sentences on those that were left."""

    freed: int
    results: int
    left: tuple[str, ...]


def results(cache: Path | str) -> list[Path]:
    """The result folders right below `cache`: those with a store's lock file and its folder of stages; no links."""
    cache = Path(cache)
    if not cache.is_dir():
        return []
    return sorted(one for one in cache.iterdir() if one.is_dir() and not one.is_symlink()
                  and (one / LOCK).is_file() and (one / STAGES).is_dir() and not (one / STAGES).is_symlink())


def size(folder: Path | str) -> int:
    """Bytes of all files in `folder`, links not followed; what vanishes meanwhile counts nothing."""
    total = 0
    for where, _, names in os.walk(folder):
        for name in names:
            try:
                total += os.lstat(os.path.join(where, name)).st_size
            except OSError:
                continue
    return total


def clear(cache: Path | str, whole: bool = False) -> Cleared:
    """Clear the stages of all result folders in `cache`, or these folders as a whole.

    Without its stages a result shows as before; only a further run begins anew. A folder that a run is writing is left
    as it is, and so is, where `whole`, one whose scene.blend was saved again since.
    """
    freed, touched, left = 0, 0, []
    for folder in results(cache):
        try:
            with Store(folder):
                if whole and _saved_again(folder):
                    left.append(f"'{folder.name}' is kept, as its {SCENE} was changed since the run.")
                    continue
                before = size(folder)
                _remove(folder / STAGES)
                if whole:
                    for one in folder.iterdir():
                        if one.name != LOCK:  # Windows removes no open file
                            _remove(one)
            if whole:
                (folder / LOCK).unlink(missing_ok=True)
                folder.rmdir()
            else:
                (folder / STAGES).mkdir(exist_ok=True)  # by which the folder is known
            freed += before - size(folder)
            touched += 1
        except (ScanRelightError, OSError) as error:
            left.append(str(error) if isinstance(error, ScanRelightError)
                        else f"'{folder.name}' can't be cleared ({error.strerror or error}).")
    return Cleared(freed, touched, tuple(left))


def _saved_again(folder: Path) -> bool:
    scene, report = folder / SCENE, folder / REPORT
    if not scene.exists():
        return False
    return not report.exists() or scene.stat().st_mtime > report.stat().st_mtime + SAVED_AGAIN


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
