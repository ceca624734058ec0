"""What ties a run to the program that started it: JSON events, stop requests and a memory limit."""

import json
import os
import threading
import time
from collections.abc import Callable
from typing import TextIO

from .core.errors import EXIT_INTERRUPTED, MemoryLimitError
from .core.kinds import Shown, Unit
from .core.memory import BUDGET, SHARE, free_memory, peak_memory, resident_memory
from .core.progress import ProgressEvent

EVENT_SECONDS: Shown[float] = 0.1
"""Progress is told at most this often, and at each stage's start and end."""
STOP = b"stop"
GRACE: Shown[float] = 5.0
"""Seconds after which a run that was let go ends at once instead of at its next safe point."""
GIGABYTE: Unit[float] = 1e9


class JsonProgress:
    """A listener for `Progress` that writes each event as one line of JSON."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._stage, self._share, self._last_write = None, 0.0, 0.0

    def __call__(self, event: ProgressEvent) -> None:
        now = time.monotonic()
        new = event.stage != self._stage
        ended = event.share >= 1.0 > self._share
        if not event.stage or not (new or ended or now - self._last_write >= EVENT_SECONDS):
            return
        self._stage, self._share, self._last_write = event.stage, event.share, now
        self.tell(
            "progress", stage=event.stage, share=event.share, overall=event.overall, seconds_left=event.seconds_left
        )

    def tell(self, kind: str, **values: object) -> None:
        """Write one line: `{"event": kind, ...}`."""
        self._stream.write(json.dumps({"event": kind, **values}) + "\n")
        self._stream.flush()

    def close(self) -> None:
        """Nothing is left open."""


class Leash:
    """Stop requests for a run whose standard input another program holds.

    The run stops where the line "stop" arrives or the input ends: so it never outlives a program that crashed.
    Where no safe point comes within `grace` seconds the process ends there; files are written whole or not at all.

    Parameters
    ----------
    descriptor : int
        Of the input; tests give another one.
    end : callable(int)
        Ends the process.
    grace : float
        Seconds; 0 where nothing is left to be finished.
    """

    def __init__(self, descriptor: int = 0, end: Callable[[int], None] = os._exit, grace: float = GRACE):
        self.requested = False
        self._descriptor, self._end, self._grace = descriptor, end, grace
        threading.Thread(target=self._watch, name="leash", daemon=True).start()

    def __call__(self) -> bool:
        """Whether a stop was requested."""
        return self.requested

    def _watch(self) -> None:
        received = b""
        while STOP not in received:
            try:
                chunk = os.read(self._descriptor, 64)
            except OSError:
                chunk = b""
            if not chunk:
                break
            received = received[-len(STOP) :] + chunk
        self.requested = True
        time.sleep(self._grace)
        self._end(EXIT_INTERRUPTED)


class MemoryGuard:
    """Stops a run that takes more memory than it may.

    Parameters
    ----------
    limit : float, optional
        Gigabytes; 0 sets no limit. None: what the process has now, and `SHARE` of what the machine has free. The run is
        told it (`BUDGET`) and works in smaller blocks to keep it.
    end : callable(str), optional
        Ends the process with the sentence where no safe point comes within `GRACE` seconds; left out, the run is only
        stopped at its safe points.
    """

    PERIOD = 0.2

    def __init__(self, limit: float | None = None, end: Callable[[str], None] | None = None):
        free, resident = free_memory(), resident_memory()
        if limit is None:
            limit = (resident + SHARE * free) / GIGABYTE if free is not None and resident is not None else 0.0
        self.limit, self.exceeded = limit, False
        BUDGET.limit = int(limit * GIGABYTE)
        self._before = peak_memory() or 0
        self._end = end
        self._done = threading.Event()
        if limit > 0 and resident is not None:
            threading.Thread(target=self._watch, name="memory guard", daemon=True).start()

    @property
    def sentence(self) -> str:
        return (
            f"The run needs more than the memory limit of {self.limit:.3g} GB and was stopped; the finished stages "
            "are kept. Raise the limit, or take a greater texel size, a smaller atlas size or fewer threads."
        )

    def __call__(self) -> bool:
        """Called where a run may be stopped; raises `MemoryLimitError` once the limit is passed."""
        if self.exceeded:
            raise MemoryLimitError(self.sentence)
        return False

    def close(self) -> None:
        self._done.set()
        BUDGET.limit = 0

    def _watch(self) -> None:
        while not self._done.wait(self.PERIOD):
            resident, peak = resident_memory() or 0, peak_memory() or 0
            if max(resident, peak if peak > self._before else 0) > self.limit * GIGABYTE:
                self.exceeded = True
                if self._end is not None and not self._done.wait(GRACE):
                    self._end(self.sentence)
                return
