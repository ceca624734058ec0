"""Mutated files of every kind, each read in a child process under a limit of memory and of time."""

from __future__ import annotations

import contextlib
import itertools
import json
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from tests.hostile.readers import readers

ROOT = Path(__file__).resolve().parents[2]
CORPUS = Path(__file__).with_name("corpus.txt")
HANG = 10.0
"""Seconds of processor time after which reading a few thousand bytes is a hang."""
WAIT = 120.0
"""Seconds after which a child that says nothing is killed: the machine may be busy with other things."""
LIMIT = 6 << 30
"""Bytes of addresses that a child may take."""
MEMORY = 300 << 20
"""Bytes that a capture of a few thousand may take."""


class Outcome(NamedTuple):
    """How one spoiled file was taken: `how` is 'read', 'refused', or what is wrong."""

    name: str
    seed: int
    how: str
    said: str
    seconds: float
    memory: int


class Child:
    """A process that reads; another in its place where it dies or hangs."""

    def __init__(self) -> None:
        self._process: subprocess.Popen | None = None

    def read(self, name: str, seed: int) -> Outcome:
        if self._process is None:
            self._start()
        started = time.monotonic()
        try:
            self._process.stdin.write(json.dumps([name, seed]) + "\n")
            self._process.stdin.flush()
            line = self._lines.get(timeout=WAIT)
        except (queue.Empty, OSError):
            line = None
        if not line:
            code, hangs = self._process.poll(), time.monotonic() - started > WAIT - 1
            told = Path(self._errors.name).read_text(errors="replace")[-1500:]
            self.close()
            return Outcome(name, seed, "hang" if hangs and code is None else f"died ({code})", told, 0, 0)
        how, said, seconds, memory, _ = json.loads(line)
        if seconds > HANG:
            how = "hang"
        if memory > MEMORY and how in ("read", "refused"):
            how = "too much memory"
        return Outcome(name, seed, how, said, seconds, memory)

    def _start(self) -> None:
        self._errors = tempfile.NamedTemporaryFile("w+")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.hostile.child", str(LIMIT)],
            cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True,
        )  # fmt: skip
        self._lines: queue.Queue[str | None] = queue.Queue()

        def listen(process=self._process, lines=self._lines) -> None:
            for line in process.stdout:
                lines.put(line)
            lines.put(None)

        threading.Thread(target=listen, daemon=True).start()

    def close(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for file in (self._process.stdin, self._process.stdout, self._errors):
                with contextlib.suppress(OSError, ValueError):
                    file.close()
            self._process = None


def corpus() -> list[tuple[str, int]]:
    """What once failed: a reader's name and the seed, a line each; without those whose library is not installed."""
    known = readers()
    lines = CORPUS.read_text(encoding="utf-8").splitlines() if CORPUS.exists() else []
    return [(name, int(seed)) for name, _, seed in (line.rpartition(" ") for line in lines) if name in known]


def chosen(seed: int, only: str = "", blender: bool = True) -> Iterator[tuple[str, int]]:
    """Readers in turn, without end, each time with another seed; below 0 by what knows the format."""
    names = [name for name, one in readers().items() if only in name and (blender or not one.blender)]
    return ((name, count) for k in itertools.count(seed) for name in names for count in (k, -k - 1))


def run(tries: Iterable[tuple[str, int]], seconds: float = float("inf")) -> tuple[Counter[str], list[Outcome]]:
    """Counts by how each try ended, the slowest ten and those that failed."""
    ends, counts, failed, child = time.monotonic() + seconds, Counter(), [], Child()
    try:
        for name, seed in tries:
            if time.monotonic() > ends:
                break
            outcome = child.read(name, seed)
            counts[outcome.how] += 1
            if outcome.how not in ("read", "refused"):
                failed.append(outcome)
    finally:
        child.close()
    return counts, failed
