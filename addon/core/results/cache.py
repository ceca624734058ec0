"""Result folders: how much they take, and clearing what can be made again: the finished stages, and nothing else."""

import contextlib
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..errors import ScanRelightError
from .store import LOCK, STAGE_FILE, STAGES, Store


@dataclass(frozen=True)
class Cleared:
    """What was cleared: bytes that are free again, how many results were touched, sentences on those that were left."""

    freed: int
    results: int
    left: tuple[str, ...]


def is_result(folder: Path) -> bool:
    """Whether a run wrote a folder: it has a store's lock file and its folder of stages; no links."""
    stages = folder / STAGES
    return (folder / LOCK).is_file() and stages.is_dir() and not folder.is_symlink() and not stages.is_symlink()


def results(parent: Path | str) -> list[Path]:
    """The result folders right below `parent`."""
    parent = Path(parent)
    return sorted(filter(is_result, parent.iterdir())) if parent.is_dir() else []


def size(folder: Path | str) -> int:
    """Bytes of all files in `folder`, links not followed; what vanishes meanwhile counts nothing."""
    total = 0
    for where, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(OSError):
                total += os.lstat(os.path.join(where, name)).st_size
    return total


def _is_stage(path: Path) -> bool:
    """Whether a file in the folder of stages is one: others may have a folder of that name, too."""
    return not path.is_symlink() and path.is_file() and re.fullmatch(STAGE_FILE, path.name) is not None


def clear(folders: Iterable[Path]) -> Cleared:
    """Clear the stages of result folders; what is no result is passed over.

    Without its stages a result shows as before; only a further run begins anew. A folder that a run is writing is left
    as it is.
    """
    freed, touched, left = 0, 0, []
    for folder in filter(is_result, dict.fromkeys(folders)):
        try:
            with Store(folder):
                for path in filter(_is_stage, (folder / STAGES).iterdir()):
                    stored = path.lstat().st_size
                    path.unlink()
                    freed += stored
            touched += 1
        except ScanRelightError as error:
            left.append(str(error))
        except OSError as error:
            left.append(f"'{folder.name}' can't be cleared ({error.strerror or error}).")
    return Cleared(freed, touched, tuple(left))
