"""Progress of a run: stage, share done, time left; and the one place where a run may be stopped."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from .errors import InterruptedRun


@dataclass(frozen=True)
class ProgressEvent:
    """What a listener is given.

    Attributes
    ----------
    stage : str
        Name of the stage that runs now.
    share : float
        Share of this stage that is done, 0...1.
    overall : float
        Share of the whole run that is done, 0...1.
    seconds_left : float or None
        Estimate for the whole run; None until something can be said.
    """

    stage: str
    share: float
    overall: float
    seconds_left: float | None


class Progress:
    """Hands events to a listener and raises `InterruptedRun` when a stop was asked for.

    Parameters
    ----------
    listener : callable(ProgressEvent), optional
        Called from the thread that runs the stages.
    should_stop : callable() -> bool, optional
        Called at every update.
    weights : dict of str to float, optional
        Expected cost of each stage, in any unit; stages not named count 1.
    """

    def __init__(
        self,
        listener: Callable[[ProgressEvent], None] | None = None,
        should_stop: Callable[[], bool] | None = None,
        weights: dict[str, float] | None = None,
    ):
        self._listener = listener or (lambda event: None)
        self._should_stop = should_stop or (lambda: False)
        self._weights = dict(weights or {"": 1.0})
        self._finished = 0.0  # weight of the finished stages
        self._stored = 0.0  # weight of stages taken from the store: they cost no time
        self._stage = ""
        self._started = time.monotonic()

    def stage(self, name: str) -> None:
        """Begin the stage `name`."""
        self._stage = name
        self.update(0.0)

    def done(self, stored: bool = False) -> None:
        """End the present stage; `stored` says that its result was already there."""
        weight = self._weights.get(self._stage, 1.0)
        self.update(1.0)
        self._finished += weight
        if stored:
            self._stored += weight
        self._stage = ""

    def update(self, share: float) -> None:
        """Say that `share` (0...1) of the present stage is done; raises `InterruptedRun` on a wished stop."""
        if self._should_stop():
            raise InterruptedRun("Stopped on request; the finished stages are kept and the next run goes on from them.")
        total = max(sum(self._weights.values()), 1e-9)
        weight = self._weights.get(self._stage, 0.0) if self._stage else 0.0
        overall = min((self._finished + weight * share) / total, 1.0)
        worked = overall - self._stored / total
        spent = time.monotonic() - self._started
        left = spent * (1.0 - overall) / worked if worked > 0.02 else None
        self._listener(ProgressEvent(self._stage, float(share), float(overall), left))


class Rounds:
    """Part of a stage that is done in rounds, nobody knows how many: each takes half of what is left.

    Parameters
    ----------
    start, end : float
        Shares of the stage.
    """

    def __init__(self, progress: Progress | None, start: float, end: float):
        self._progress, self._start, self._end = progress, start, end

    def update(self, share: float) -> None:
        """Say that `share` (0...1) of the present round is done."""
        if self._progress is not None:
            self._progress.update(self._start + 0.5 * share * (self._end - self._start))

    def next(self) -> None:
        """Begin the next round."""
        self._start += 0.5 * (self._end - self._start)
