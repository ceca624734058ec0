"""Running estimates of a typical value for each of n elements and three channels, by name.

All share one interface (`estimator.Estimator`): `add(element, values)` with each element at most once a call, and
`result()`. Measured against one another: `scan-relight benchmark lit_diffuse`.
"""

from collections.abc import Callable
from pathlib import Path

from ..paper.p_square import PSquare, Summary
from .estimator import Estimator
from .exact import Exact
from .mean import Mean

__all__ = ["Estimator", "Exact", "Mean", "PSquare", "Summary", "make_estimator"]


def make_estimator(name: str, count: int, folder: Path | str | None = None, threads: int = 0) -> Estimator:
    """'exact', 'p2' (the paper's) or 'mean' for `count` elements; `folder` takes what 'exact' writes to disk."""
    make: dict[str, Callable[[], Estimator]] = {
        "exact": lambda: Exact(count, folder, threads),
        "p2": lambda: PSquare(count),
        "mean": lambda: Mean(count),
    }
    return make[name]()
