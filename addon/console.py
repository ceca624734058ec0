"""A run on the console: progress as one rewritten line or as lines of a log, and Ctrl-C."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from .core.kinds import Shown
from .core.progress import ProgressEvent

LOG_SECONDS: Shown[float] = 15.0
"""A log gets a line at each stage's start and end, and after this many seconds within one."""
TTY_SECONDS: Shown[float] = 0.1


def duration(seconds: float) -> str:
    """Seconds as readable text: '8 s', '2 min 05 s', '1 h 10 min'."""
    seconds = int(round(seconds))
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02d} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"


class ConsoleProgress:
    """A listener for `Progress` that writes to `stream`.

    Parameters
    ----------
    stream : text file
        Where it is a terminal, one line is rewritten; else plain lines are added.
    quiet : bool
        Write nothing at all.
    """

    def __init__(self, stream: TextIO, quiet: bool = False):
        self._stream, self._quiet = stream, quiet
        self._tty = stream.isatty()
        self._stage, self._share, self._last_write, self._width = None, 0.0, 0.0, 0

    def __call__(self, event: ProgressEvent) -> None:
        if self._quiet or not event.stage:
            return
        new, now = event.stage != self._stage, time.monotonic()
        ended = event.share >= 1.0 and (new or self._share < 1.0)
        due = now - self._last_write >= (TTY_SECONDS if self._tty else LOG_SECONDS)
        self._stage, self._share = event.stage, event.share if new else max(event.share, self._share)
        if not (new or ended or due):
            return
        self._last_write = now
        text = f"{event.stage.replace('_', ' '):<12} {self._share:4.0%}   whole {event.overall:4.0%}"
        if event.seconds_left is not None and event.overall < 1:
            text += f"   about {duration(event.seconds_left)} left"
        if self._tty:
            filled = int(event.overall * 20)
            text = f"[{'#' * filled}{'.' * (20 - filled)}] {text}"
            self._stream.write("\r" + text.ljust(self._width))
            self._width = len(text)
        else:
            self._stream.write(text + "\n")
        self._stream.flush()

    def close(self) -> None:
        """Leave the line that was rewritten."""
        if self._tty and self._width:
            self._stream.write("\n")
            self._stream.flush()
            self._width = 0


class StopSignal:
    """While entered, the first Ctrl-C or SIGTERM is only noted; a second one takes effect at once."""

    def __init__(self):
        self.requested = False
        self._before = {}

    def __call__(self) -> bool:
        """Whether a stop was requested."""
        return self.requested

    def __enter__(self) -> StopSignal:
        for number in (signal.SIGINT, signal.SIGTERM):
            with contextlib.suppress(ValueError):  # not the main thread: then nobody sends it signals
                self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *exception: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        self._before.clear()

    def _note(self, number, frame):
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True


@contextlib.contextmanager
def own_console(keep_others: bool = False) -> Iterator[TextIO]:
    """Yield the real standard output, and discard what libraries write to it below Python.

    That is Blender's chatter and OpenEXR's remarks on damaged pictures, which the program tells in its own words.

    Parameters
    ----------
    keep_others : bool
        Let the others through.
    """
    if keep_others:
        yield sys.stdout
        return
    with contextlib.ExitStack() as stack:
        out = stack.enter_context(_alone("stdout", 1))
        stack.enter_context(contextlib.redirect_stderr(stack.enter_context(_alone("stderr", 2))))
        if out is not sys.stdout:  # a process of our own: warnings are for developers, and tests see them
            stack.enter_context(warnings.catch_warnings(action="ignore"))
        yield out


@contextlib.contextmanager
def _alone(name: str, number: int) -> Iterator[TextIO]:
    """Yield the standard stream `name`, while other writes to its descriptor `number` are discarded."""
    standard = getattr(sys, name)
    try:
        direct = standard.fileno() == number
    except (AttributeError, OSError, ValueError):
        direct = False
    if not direct:
        yield standard
        return
    standard.flush()
    _flush_c()
    saved = os.dup(number)
    stream = os.fdopen(os.dup(saved), "w", 1 if number == 2 else -1, encoding=standard.encoding, errors="replace")
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, number)
        yield stream
    finally:
        with contextlib.suppress(OSError):
            stream.close()
        standard.flush()
        _flush_c()
        os.dup2(saved, number)
        os.close(saved)
        os.close(null)


def _flush_c() -> None:
    """Empty the C library's output buffers, which Blender's prints stand in."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        (ctypes.cdll.ucrtbase if os.name == "nt" else ctypes.CDLL(None)).fflush(None)


def unexpected(error: Exception, folder: Path | str | None) -> str:
    """One sentence for an unexpected error; its traceback goes into the file error.log in `folder`."""
    sentence = f"Unexpected error ({type(error).__name__}: {' '.join(str(error).split())})"
    if folder:
        log = Path(folder) / "error.log"
        try:
            log.unlink(missing_ok=True)  # a link there stays within the folder
            log.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
            return f"{sentence}; please report it with '{log}'."
        except OSError:
            pass
    return f"{sentence}; please report it."
