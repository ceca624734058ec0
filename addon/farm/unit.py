"""One unit of work under its lock, and the mark that it leaves for `status`."""

import contextlib
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..core.atomic import write_bytes
from ..core.errors import InterruptedRun, ScanRelightError, one_line
from ..core.memory import peak_memory
from ..core.results.archive import Damaged, read_archive
from ..core.results.lock import held, machine
from ..core.results.store import STAGES as STORED
from .plan import FOLDER, make_folder, unit_name


@contextlib.contextmanager
def unit(result: Path, stage: str, block: tuple[int, int] | None, should_stop: Callable[[], bool]) -> Iterator[None]:
    """Hold the lock of a unit of work, and mark how it ended.

    Raises
    ------
    InterruptedRun
        `should_stop`, while another worker does the same unit.
    StorageError
    """
    folder, name = result / FOLDER, unit_name(stage, block)
    make_folder(folder)
    with held(folder / f"{name}.lock", should_stop):
        started = time.monotonic()
        mark: dict[str, Any] = {"machine": machine().split()[0]}
        try:
            yield
        except (InterruptedRun, KeyboardInterrupt):
            raise
        except Exception as error:
            known = isinstance(error, ScanRelightError)
            mark["error"] = str(error) if known else one_line(f"{type(error).__name__}: {error}")
            with contextlib.suppress(ScanRelightError):  # the error itself may be a full disk
                _mark(folder, name, mark)
            raise
        mark |= {"seconds": round(time.monotonic() - started, 2), "peak_memory_bytes": peak_memory()}
        _mark(folder, name, mark | {"key": stored_key(result, name)})


def stored_key(result: Path, name: str) -> str | None:
    """The key of a unit's stored result; None where it stores none, or that is damaged."""
    try:
        return read_archive(result / STORED / f"{name}.npz", ())[0]["key"]
    except (OSError, Damaged, KeyError, TypeError):
        return None


def _mark(folder: Path, name: str, mark: dict[str, Any]) -> None:
    write_bytes(folder / f"{name}.json", json.dumps(mark, ensure_ascii=False).encode() + b"\n")
