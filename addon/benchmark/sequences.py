"""Sequences of observations whose exact median is known: what frames may show of a spot, kind and worst."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.kinds import Workload

NOISE: Workload[float] = 0.03
"""Relative, of every observation."""
HIGHLIGHT: Workload[float] = 3.25
"""Mean of a highlight's radiance over the diffuse one."""


def video(n: int, elements: int, share: float, rng: np.random.Generator) -> np.ndarray:
    """Radiance near 1, and a highlight in one stretch of `share` of the frames: what a camera moving past shows."""
    block = int(share * n)
    start = rng.integers(0, n - block + 1, (1, elements, 1))
    frame = np.arange(n)[:, None, None]
    bright = (frame >= start) & (frame < start + block)
    x = 1 + bright * rng.exponential(HIGHLIGHT, (n, elements, 1))
    return (x * np.exp(NOISE * rng.standard_normal((n, elements, 3)))).astype(np.float32)


def ascending(n: int, elements: int, rng: np.random.Generator) -> np.ndarray:
    """All in order of size, a third of them highlights: the worst for a summary in constant memory."""
    return np.sort(video(n, elements, 1 / 3, rng), axis=0)


def tied(n: int, elements: int, rng: np.random.Generator) -> np.ndarray:
    """Few values, many times each: a clean rendering."""
    return rng.choice(np.float32([0, 0.25, 0.5, 2]), (n, elements, 3), p=[0.05, 0.25, 0.45, 0.25])


def wide(n: int, elements: int, rng: np.random.Generator) -> np.ndarray:
    """Spread evenly over six decades."""
    return (10 ** rng.uniform(-4, 2, (n, elements, 3))).astype(np.float32)


SEQUENCES: dict[str, Callable[[int, int, np.random.Generator], np.ndarray]] = {
    **{
        f"video, {share} % highlights": lambda n, elements, rng, share=share: video(n, elements, share / 100, rng)
        for share in (0, 20, 40, 45)
    },
    "ascending": ascending,
    "descending": lambda n, elements, rng: ascending(n, elements, rng)[::-1],
    "tied": tied,
    "six decades": wide,
}
"""Each gives (n, elements, 3) float32, in the order in which the frames come."""
