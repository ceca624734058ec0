"""Seconds of one call."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from typing import Any, NamedTuple


class Timing(NamedTuple):
    """Seconds by the clock on the wall; of all threads of this process, which others disturb less; what came back."""

    seconds: float
    cpu_seconds: float
    value: Any


def once(function: Callable[[], Any]) -> Timing:
    """One call, timed."""
    gc.collect()  # not in the middle, at one alternative's expense
    started, cpu_started = time.perf_counter(), time.process_time()
    value = function()
    return Timing(time.perf_counter() - started, time.process_time() - cpu_started, value)
