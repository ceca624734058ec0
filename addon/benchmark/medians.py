"""Running medians: error against the exact median, bytes and time an observation, in the orders that videos have."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..core.kinds import Workload
from ..core.lit_diffuse.accumulate import frame_order
from ..core.lit_diffuse.adaptive import Adaptive
from ..core.lit_diffuse.batched import Batched
from ..core.lit_diffuse.estimator import Estimator
from ..core.lit_diffuse.exact import Exact
from ..core.lit_diffuse.medians import make_estimator
from ..core.settings import PAPER, Settings
from .run import Options
from .sequences import SEQUENCES
from .table import BASELINE, Curves, Table
from .timing import alternately

COUNTS: Workload[tuple[int, ...]] = (5, 12, 30, 100, 400, 2000)
LARGE_COUNTS: Workload[tuple[int, ...]] = (5, 12, 30, 100, 400, 2000, 5000)
ELEMENTS: Workload[int] = 100
LARGE_ELEMENTS: Workload[int] = 1000
TIMED_COUNTS: Workload[tuple[int, int, int]] = (12, 100, 400)
TIMED_ELEMENTS: Workload[int] = 4096
TIMED = "video, 20 % highlights"
SHINING = tuple(name for name in SEQUENCES if name.startswith("video") and " 0 %" not in name)


@dataclass(frozen=True)
class Rival:
    """An estimator and the order in which it gets the frames."""

    make: Callable[[int], Estimator]
    order: str


def _named(name: str, order: str) -> Rival:
    return Rival(lambda count: make_estimator(name, count, threads=1), order)


PAPERS = "P-square, as filmed (paper)"
DEFAULT = "default: adaptive, shuffled"
RIVALS = {
    "mean": _named("mean", "capture"),
    PAPERS: _named(PAPER.median, "capture"),
    "P-square, shuffled": _named("p2", "shuffled"),
    "summary, as filmed": Rival(Batched, "capture"),
    DEFAULT: _named(Settings().median, "shuffled"),
    "exact": _named("exact", "capture"),
}


def run(options: Options) -> Iterator[Table]:
    """The tables of this stage: error in every sequence, then cost."""
    yield _errors(options)
    yield _costs(options)


def feed(rival: Rival, x: np.ndarray, seed: int) -> Estimator:
    """An estimator that has seen the observations `x` ((n, elements, 3)) in the rival's order."""
    estimator, every = rival.make(x.shape[1]), np.arange(x.shape[1], dtype=np.int32)
    for frame in frame_order(len(x), seed) if rival.order == "shuffled" else range(len(x)):
        estimator.add(every, x[frame])
    return estimator


def log_error(found: np.ndarray, true: np.ndarray) -> float:
    """RMS of log(found / true); what is darker than a millionth counts as that."""
    floor = 1e-6
    return float(np.sqrt(np.mean(np.log(np.maximum(found, floor) / np.maximum(true, floor), dtype=np.float64) ** 2)))


def stored_bytes(estimator: Estimator, elements: int) -> tuple[float, float]:
    """Bytes an element in memory, and on disk. What `Exact` still holds in its buffer, of one size for all, is counted
    as on disk, where most of it goes."""
    if isinstance(estimator, Adaptive):
        estimator = estimator.now
    if isinstance(estimator, Exact):
        return 0.0, estimator.observations * Exact.RECORD.itemsize / elements
    return sum(a.nbytes for a in vars(estimator).values() if isinstance(a, np.ndarray)) / elements, 0.0


def _errors(options: Options) -> Table:
    counts, elements = (LARGE_COUNTS, LARGE_ELEMENTS) if options.large else (COUNTS, ELEMENTS)
    rows = []
    for done, (name, make) in enumerate(SEQUENCES.items()):
        for n in counts:
            x = make(n, elements, np.random.default_rng([options.seed, done, n]))
            true = np.median(x, axis=0)
            found = {}
            for rival in RIVALS:
                estimator = feed(RIVALS[rival], x, options.seed)
                memory, disk = stored_bytes(estimator, elements)
                found[rival] = (log_error(estimator.result().median, true), memory, disk)
                estimator.close()
            for rival, (error, memory, disk) in found.items():
                against = error / found[PAPERS][0] if found[PAPERS][0] else None
                rows.append((name, n, rival, rival == PAPERS, error, against, memory, disk))
            options.progress.update(0.8 * (done + counts.index(n) / len(counts)) / len(SEQUENCES))
    shining = [(against, name, n) for name, n, rival, _, _, against, *_ in rows
               if rival == DEFAULT and name in SHINING and against is not None]  # fmt: skip
    against, name, n = max(shining)
    return Table(
        "medians",
        "Running medians: error",
        ("sequence", "observations", "alternative", BASELINE, "RMS log error", "error against paper's",
         "bytes an element, memory", "bytes an element, disk"),
        rows,
        (
            f"Of the paper's error, the default has at most {against:.2g} in videos with highlights ({name}, {n}).",
            "Where nothing shines, both are far below the noise.",
            "3 % noise; a video's highlights are in one stretch of the frames. 'shuffled' means a fixed pseudo-random "
            "order of the frames.",
        ),
        Curves("sequence", "alternative", "observations", "RMS log error"),
    )  # fmt: skip


def _costs(options: Options) -> Table:
    rows = []
    for n in TIMED_COUNTS:
        x = SEQUENCES[TIMED](n, TIMED_ELEMENTS, np.random.default_rng([options.seed, n]))

        def whole(rival: Rival, x=x) -> None:
            estimator = feed(rival, x, options.seed)
            estimator.result()
            estimator.close()

        times = alternately({name: lambda rival=rival: whole(rival) for name, rival in RIVALS.items()}, repeats=2)
        papers = times[PAPERS].cpu_seconds
        for name, timing in times.items():
            nanoseconds = 1e9 * timing.cpu_seconds / (n * TIMED_ELEMENTS)
            rows.append((TIMED, n, name, name == PAPERS, nanoseconds, 1e3 / nanoseconds, timing.cpu_seconds / papers))
        options.progress.update(0.8 + 0.2 * (TIMED_COUNTS.index(n) + 1) / len(TIMED_COUNTS))
    return Table(
        "medians-cost",
        "Running medians: time",
        ("sequence", "observations", "alternative", BASELINE, "ns an observation", "million observations a second",
         "time against paper's"),
        rows,
        (f"Of three channels each, {TIMED_ELEMENTS} elements, processor time, the result included.",),
    )  # fmt: skip
