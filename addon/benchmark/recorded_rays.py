"""The rays that a piece of code traces, kept so that they can be traced again by themselves."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from ..core.parallel import ordered_map
from ..core.scene.rays import RayScene


class RecordedRays:
    """Batches of rays in the order in which they were traced."""

    def __init__(self, scene: RayScene, traced: Callable):
        self._scene, self._traced = scene, traced
        self.batches: list[tuple[np.ndarray, np.ndarray, dict]] = []

    def __len__(self) -> int:
        return sum(len(origins) for origins, _, _ in self.batches)

    def trace(self, threads: int = 0) -> None:
        """Trace them all again, on all cores, and do nothing with what is hit."""

        def run(batch) -> None:
            origins, directions, how = batch
            self._traced(origins, directions, **how)

        for _ in ordered_map(run, self.batches, threads):
            pass


@contextmanager
def recorded(scene: RayScene) -> Iterator[RecordedRays]:
    """Keep what `scene` traces meanwhile. Memory grows by 24 bytes a ray."""
    traced = scene._run
    rays, lock = RecordedRays(scene, traced), threading.Lock()

    def keep(origins, directions, **how):
        with lock:
            rays.batches.append((np.array(origins, np.float32), np.array(directions, np.float32), how))
        return traced(origins, directions, **how)

    scene._run = keep
    try:
        yield rays
    finally:
        del scene._run
