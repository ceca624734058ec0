"""Peak memory of this process."""

from __future__ import annotations

import sys


def peak_memory() -> int | None:
    """Highest resident size so far in bytes; None where the system doesn't tell (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else peak * 1024)
