"""Whether what a surface's points are off by is noise, each point by itself, or shape, which neighbours share."""

from __future__ import annotations

import numpy as np

from ...weighted import weighted_median

SURE = 3.0
"""Standard errors."""
SLACK = 2.0
"""Times more alike than is usual that a flat part may be: parts of a scan differ in how much of its smooth error they
have. With 1, walls of finely meshed rooms were no sheets (half of the noise smooth; normals off by 1.2 degrees instead
of .8)."""


def moran(off: np.ndarray, faces: np.ndarray) -> tuple[float, float]:
    """How alike neighbours are: Moran's I (Moran 1950), the mean of r_i r_j over the edges i-j by that of r_i^2.

    Parameters
    ----------
    off : (p,) float
        What each point of a mesh is off by; only points of `faces` are heeded.
    faces : (t, 3) int

    Returns
    -------
    I : float
        0 for noise from point to point, 1 for what varies slowly; below 0 where neighbours differ more than others.
    error : float
        Standard error of I where there is nothing but noise.
    """
    edges = np.sort(np.concatenate([faces[:, :2], faces[:, 1:], faces[:, [2, 0]]]), 1)
    name = np.unique(edges[:, 0].astype(np.int64) * len(off) + edges[:, 1])
    one, other = np.divmod(name, len(off))
    squared = float(np.mean(off[np.unique(faces)] ** 2))
    return float(np.mean(off[one] * off[other])) / max(squared, 1e-30), 1 / np.sqrt(len(name))


def most_alike(index: list[float], weight: list[float]) -> float:
    """How large the I of a flat part may be that a scan's smooth error makes: `SLACK` times the weighted median of some
    parts' I, most of which are flat; at least 0.
    """
    if not index:
        return 0.0
    return SLACK * max(weighted_median(np.asarray(index), np.asarray(weight)), 0.0)
