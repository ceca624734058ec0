"""Typed errors. The text of each is the one sentence that a user reads: which file, what is wrong, what to do."""

from pathlib import Path

from .kinds import Code, Shown

EXIT_OK: Code[int] = 0
EXIT_FAILURE: Code[int] = 1
EXIT_BAD_INPUT: Code[int] = 2
EXIT_INTERRUPTED: Code[int] = 130


LONGEST: Shown[int] = 2000
"""Characters of a sentence; what is longer holds a file's content, and is shown by its two ends."""


def one_line(sentence: str) -> str:
    """The sentence as a console can show it: names in it may hold line breaks and what is no character at all."""
    printable = "".join(c if c.isprintable() else "\ufffd" for c in sentence)
    return printable if len(printable) <= LONGEST else f"{printable[: LONGEST // 2]} ... {printable[-LONGEST // 2 :]}"


class ScanRelightError(Exception):
    """Base of every error that is shown to the user in one sentence."""

    exit_code = EXIT_FAILURE

    def __init__(self, sentence: str = ""):
        super().__init__(one_line(str(sentence)))


class BadInputError(ScanRelightError):
    """The capture, a setting or the output folder can't be used as given."""

    exit_code = EXIT_BAD_INPUT


def check_path(path: Path) -> None:
    """Raise `BadInputError` for a path that the system won't look up: too long, a link to itself, a stale disk."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        pass  # it may be made yet; who reads it says so
    except OSError as error:
        raise BadInputError(f"'{path}' can't be used as a path ({error.strerror or error}); choose another.") from error


class MissingStageError(ScanRelightError):
    """A stage was requested whose predecessor has not been run yet."""

    exit_code = EXIT_BAD_INPUT


class StorageError(ScanRelightError):
    """The result folder can't be written any more (disk full, folder taken away)."""


class MemoryLimitError(ScanRelightError):
    """The run needs more memory than it may take."""


class InterruptedRun(ScanRelightError):
    """The user asked to stop; every finished stage is kept."""

    exit_code = EXIT_INTERRUPTED
