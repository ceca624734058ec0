"""Work cut into blocks and shared between threads. NumPy's loops and embree both release the GIL."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

from .kinds import Code
from .memory import BUDGET
from .progress import Progress, Rounds

ONE_BLAS_THREAD: Code[dict[str, str]] = {"OPENBLAS_NUM_THREADS": "1"}
"""Environment of a process that runs stages, from before NumPy is loaded. All cores are used already, and products are
of a few thousand numbers: BLAS's own threads wait for each other in loops (`find_sun`: half of its processor time)."""


def thread_count(threads: int) -> int:
    """Threads to use: `threads`, or all cores this process may use where it is 0."""
    if threads > 0:
        return threads
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def blocks(count: int, size: int) -> list[slice]:
    """Cut range(count) into slices of at most `size`."""
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]


def ordered_map(function: Callable, items: Iterable, threads: int, ahead: int | None = None, each: int = 0) -> Iterator:
    """Yield function(item) in the order of the items, with a bounded number of results waiting.

    At most `threads + ahead` results exist at once, so that memory does not grow with the number of items; and no more
    than fit into the budget if each takes `each` bytes. `ahead` is as many as there are threads where not given: with
    fewer, threads wait for work while the next in order is a slow one.
    """
    workers = thread_count(threads)
    ahead = workers if ahead is None else ahead
    fitting = BUDGET.fitting(workers + ahead, each)
    workers = min(workers, fitting)
    ahead = fitting - workers
    pending: list = []
    with ThreadPoolExecutor(workers) as pool:
        try:
            for item in items:
                pending.append(pool.submit(function, item))
                if len(pending) >= workers + ahead:
                    yield pending.pop(0).result()
            while pending:
                yield pending.pop(0).result()
        finally:
            for future in pending:
                future.cancel()


def for_blocks(
    function: Callable[[slice], None], count: int, size: int, threads: int, progress: Progress | Rounds | None = None
) -> None:
    """Run function(block) for every block of range(count); raises what a block raised, or `InterruptedRun`."""
    todo = blocks(count, size)
    if thread_count(threads) == 1 or len(todo) <= 1:  # a pool for one thread costs a switch of threads for each block
        for number, block in enumerate(todo, 1):
            function(block)
            if progress is not None:
                progress.update(number / len(todo))
        return
    with ThreadPoolExecutor(thread_count(threads)) as pool:
        waiting = {pool.submit(function, block) for block in todo}
        try:
            while waiting:
                done, waiting = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    future.result()
                if progress is not None:
                    progress.update(1.0 - len(waiting) / max(len(todo), 1))
        finally:
            for future in waiting:
                future.cancel()
