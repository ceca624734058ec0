"""Seconds that can be compared: alternatives take turns, and each one's fastest turn counts."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Timing:
    """The fastest of several turns.

    Attributes
    ----------
    seconds : float
        By the clock on the wall.
    cpu_seconds : float
        Of all threads of this process. Other programs disturb it less, so ratios are taken of these.
    value : object
        What the function gave, the last time.
    """

    seconds: float
    cpu_seconds: float
    value: Any


def once(function: Callable[[], Any]) -> Timing:
    """One call, timed."""
    gc.collect()  # not in the middle, at one alternative's expense
    started, cpu_started = time.perf_counter(), time.process_time()
    value = function()
    return Timing(time.perf_counter() - started, time.process_time() - cpu_started, value)


def alternately(functions: Mapping[str, Callable[[], Any]], repeats: int = 3) -> dict[str, Timing]:
    """Call all functions in turn, `repeats` times over; of each the least wall and the least processor time.

    A machine that others use is slow for seconds at a time: turns spread that over all alternatives, and the minimum
    is what is left of it least.
    """
    turns: dict[str, list[Timing]] = {name: [] for name in functions}
    for _ in range(repeats):
        for name, function in functions.items():
            turns[name].append(once(function))
    return {
        name: Timing(min(t.seconds for t in taken), min(t.cpu_seconds for t in taken), taken[-1].value)
        for name, taken in turns.items()
    }
