"""What the system or one of Blender's operators refuses, in one sentence."""

from collections.abc import Iterator
from contextlib import contextmanager

from ..core.errors import StorageError


def reason_of(error: Exception) -> str:
    """Why, in a line: the system's word, or an operator's without what Blender puts around it."""
    return " ".join(str(getattr(error, "strerror", None) or error).split()).removeprefix("Error: ").rstrip(".")


@contextmanager
def refused(what: str, advice: str) -> Iterator[None]:
    """Raise a `StorageError` for what is refused within: "`what` (the reason); `advice`."."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        raise StorageError(f"{what} ({reason_of(error)[:300]}); {advice}.") from error
