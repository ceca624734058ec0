"""Typed errors. The text of each is the one sentence that a user reads: which file, what is wrong, what to do."""

from __future__ import annotations

EXIT_OK = 0
EXIT_FAILURE = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


class ScanRelightError(Exception):
    """Base of every error that is told to the user in one sentence."""

    exit_code = EXIT_FAILURE


class BadInputError(ScanRelightError):
    """The capture, a setting or the output folder can't be used as given."""

    exit_code = EXIT_BAD_INPUT


class MissingStageError(ScanRelightError):
    """A stage was asked for whose forerunner has not been run yet."""

    exit_code = EXIT_BAD_INPUT


class StorageError(ScanRelightError):
    """The result folder can't be written any more (disk full, folder taken away)."""


class MemoryLimitError(ScanRelightError):
    """The run needs more memory than it may take."""


class InterruptedRun(ScanRelightError):
    """The user asked to stop; every finished stage is kept."""

    exit_code = EXIT_INTERRUPTED
