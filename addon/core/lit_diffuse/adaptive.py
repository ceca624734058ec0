"""The default median: exact while all observations take no more room than a summary would, a summary from then on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..paper.p_square import Summary
from .batched import Batched
from .exact import Exact
from .params import MEDIANS


class Adaptive:
    """`Exact` for as long as `exact_bytes` allow, then `Batched`, which is told all that was seen until then.

    Sorting once at the end costs less than renewing knots again and again, and has no error; but its disk grows with
    the video. Short videos, and kinds of observations that are rare, never need more.

    Attributes
    ----------
    now : Exact or Batched
        What takes the observations at present.
    """

    def __init__(self, count: int, folder: Path | str | None = None, threads: int = 0):
        self._count, self._threads = count, threads
        self.now: Exact | Batched = Exact(count, folder, threads)
        self._left = MEDIANS.exact_bytes // Exact.RECORD.itemsize * count

    def add(self, element: np.ndarray, values: np.ndarray) -> None:
        if isinstance(self.now, Exact):
            self._left -= len(element)
            if self._left < 0:
                self._settle(self.now)
        self.now.add(element, values)

    def _settle(self, exact: Exact) -> None:
        """Hand the observations over to a summary."""
        self.now = Batched(self._count, self._threads)
        for element, values in exact.replay():
            self.now.add(element, values)
        exact.close()

    def result(self) -> Summary:
        return self.now.result()

    def close(self) -> None:
        self.now.close()
