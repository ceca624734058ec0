"""A command in a process of its own, and the run that is going on now.

A run shares nothing with Blender's window but two pipes: it can't hold the window up, and undo, another file or a
crash on either side can't harm the other. Nothing of it is kept in Blender's data. This module knows no Blender.
"""

import atexit
import contextlib
import json
import os
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

from ...core.errors import EXIT_INTERRUPTED, EXIT_OK, StorageError
from ...core.kinds import Shown
from ...core.parallel import ONE_BLAS_THREAD
from ...temporary import RunFolder

GRACE: Shown[float] = 0.5
"""Seconds between the request to stop and the end of the process: finished stages are whole files by then."""
RUNNING, STOPPED, DONE, FAILED = "running", "stopped", "done", "failed"
STOPPED_TEXT = "Stopped; the finished stages are kept and the next run goes on from them."
ERROR_PREFIX = "scan-relight: "
"""Prefix of the command line's errors."""


class Job:
    """A command that runs beside Blender; it starts at once.

    Parameters
    ----------
    command : sequence of str
        Program and arguments; ends its work when its standard input ends.
    **facts
        What the interface has to remember of it; kept in `facts`.

    Attributes
    ----------
    state : str
        `RUNNING`, `STOPPED`, `DONE` or `FAILED`.
    stage, share, overall
        Name of the stage that is worked at ('' before the first); how much of it and of the whole is done, 0...1.
    sentence : str
        Why it ended without being done; '' else.
    answer, text
        What the command said at its end, and everything else that it wrote to standard output.
    """

    def __init__(self, command: Sequence[str], **facts: object):
        self.facts = facts
        self.state, self.stage, self.share, self.overall = RUNNING, "", 0.0, 0.0
        self.warnings: list[str] = []
        self.sentence, self.text = "", ""
        self.answer: dict = {}
        self.started, self.ended = time.monotonic(), None
        self._estimate: float | None = None
        self._estimated_at = self.started
        self._stop_requested_at: float | None = None
        self._errors: deque[str] = deque(maxlen=40)
        self._finished = threading.Event()
        flags = {"start_new_session": True}
        if os.name == "nt":
            flags = {"creationflags": subprocess.CREATE_NO_WINDOW | subprocess.BELOW_NORMAL_PRIORITY_CLASS}
        self._folder = RunFolder()
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=ONE_BLAS_THREAD | os.environ | self._folder.environment,
                **flags,  # fmt: skip
            )
        except OSError as error:
            self._folder.close()
            raise StorageError(f"The run can't be started ({error.strerror or error}); start Blender anew.") from error
        _alive.add(self)
        self._readers = [_start(self._read, "output"), _start(self._read_errors, "errors")]
        _start(self._wait, "end")

    @property
    def running(self) -> bool:
        """Whether its process has not ended yet."""
        return self.state == RUNNING

    @property
    def stopping(self) -> bool:
        """Whether it was asked to stop and has not ended yet."""
        return self.running and self._stop_requested_at is not None

    @property
    def seconds(self) -> float:
        """How long it has run."""
        return (self.ended if self.ended is not None else time.monotonic()) - self.started

    @property
    def seconds_left(self) -> float | None:
        """Estimate that counts down between the run's own; None while there is none."""
        return None if self._estimate is None else max(self._estimate - (time.monotonic() - self._estimated_at), 0.0)

    def stop(self) -> None:
        """Request its end, and kill it after `GRACE` seconds; returns at once."""
        if not self.running or self._stop_requested_at is not None:
            return
        self._stop_requested_at = time.monotonic()
        _start(self._end, "stop")

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end; returns whether it came in time."""
        return self._finished.wait(timeout)

    def _end(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(b"stop\n")
            self._process.stdin.close()
        try:
            self._process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()

    def _read(self) -> None:
        output = []
        for line in self._process.stdout:
            text = line.decode("utf-8", "replace")
            try:
                event = json.loads(text) if text.startswith('{"event": ') else None
            except ValueError:
                event = None
            if event is None:
                output.append(text)
            else:
                self._take(event)
        self.text = "".join(output)

    def _take(self, event: dict) -> None:
        kind = event.pop("event")
        if kind == "progress":
            self.stage, self.share, self.overall = event["stage"], event["share"], event["overall"]
            self._estimate, self._estimated_at = event["seconds_left"], time.monotonic()
        elif kind == "warning":
            self.warnings.append(event["text"])
        elif kind == "done":
            self.answer = event

    def _read_errors(self) -> None:
        for line in self._process.stderr:
            self._errors.append(line.decode("utf-8", "replace").rstrip())

    def _wait(self) -> None:
        code = self._process.wait()
        for reader in self._readers:
            reader.join(2.0)  # a grandchild may hold the pipe open
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            with contextlib.suppress(OSError, ValueError):
                pipe.close()
        self._folder.close()
        self.ended = time.monotonic()
        if code == EXIT_OK:
            state = DONE
        elif code == EXIT_INTERRUPTED or self._stop_requested_at is not None:
            state, self.sentence = STOPPED, STOPPED_TEXT
        else:
            state, self.sentence = FAILED, self._reason(code)
        _alive.discard(self)
        self.state = state  # last: whoever sees it finds everything else in place
        self._finished.set()

    def _reason(self, code: int) -> str:
        errors = [line.removeprefix(ERROR_PREFIX) for line in self._errors if line.startswith(ERROR_PREFIX)]
        if errors:
            return errors[-1]
        if code in (-9, 137):
            return (
                "The system ended the run, most likely because memory ran out; the finished stages are kept. "
                "Take a greater texel size or a smaller atlas size, or close other programs."
            )
        last_line = next((line for line in reversed(self._errors) if line.strip()), "it left no word")
        return f"The run ended with code {code}: {last_line[:300]}"


def _start(target: Callable[[], None], name: str) -> threading.Thread:
    thread = threading.Thread(target=target, name=f"scan relight {name}", daemon=True)
    thread.start()
    return thread


_alive: set[Job] = set()
_current: Job | None = None


def current() -> Job | None:
    """The run that is going on, or the last one of this session; None where there was none."""
    return _current


def running() -> Job | None:
    """The run that is going on, or None."""
    return _current if _current is not None and _current.running else None


def begin(command: Sequence[str], **facts: object) -> Job:
    """Start a run and make it the current one; only where none is `running`."""
    global _current
    if running():
        raise RuntimeError("a run is going on")
    _current = Job(command, **facts)
    return _current


def forget() -> None:
    """Drop the current run; stops it if it is still going on."""
    global _current
    if _current is not None:
        _current.stop()
    _current = None


@atexit.register
def end_all() -> None:
    """End every process at once: Blender closes, or the add-on goes."""
    for job in list(_alive):
        with contextlib.suppress(OSError):
            job._process.kill()
