"""Bevels of a flat mirror, from what they show.

A bevel is some millimetres deep: a scan's noise hides it, and what takes the noise out makes it flat. But each facet
shows another part of the room, so the frames tell its way as they tell the plane's (`flat_mirrors`). Of the living
room's mirror with vertices off by 5 mm, eight triangles of 4 cm by 1.3 m come out within 0.001 to 0.014 radians of
their true 0.1, each from 100 to 2,200 observations.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from ...light.field import LightField
from ...light.mirrors import Mirror
from ...scene.samples import Samples
from .mirrored import LEAST, Views, sides_of, turned

STEEPEST, STEP = 0.16, 0.02
"""Radians: how far from the plane a facet is looked for, and how densely; what is mirrored in the grid's next way is
still like what is mirrored in the true one."""
MOST_OFF_PLANE = 0.3
"""Radians from the mirror's plane; triangles that the mesh turns further are no part of its face."""
SEARCHED, FITTED = 1500, 6000
"""Observations at most."""
TRIALS = 60
BETTER = 0.9
"""Share of the plane's deviation, over frames that it was not fitted to, that a facet must come below."""
MOST = 64
"""Triangles with enough observations. A mirror of more is scanned finely: its bevels show in the mesh."""


def facets_of(field: LightField, samples: Samples, mirror: Mirror) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of a mirror that face another way than its plane, and which.

    Parameters
    ----------
    field : LightField
        The room without this mirror: rays start at it.

    Returns
    -------
    triangle : (k,) int32
    normal : (k, 3) float32
        Unit, on the side of the mirror's.
    """
    none = np.zeros(0, np.int32), np.zeros((0, 3), np.float32)
    triangle = field.atlas.triangle[samples.element]
    own = (field.mesh.object_id[triangle] == mirror.object_id) & ~samples.saturated
    own &= np.abs(field.normal[triangle] @ mirror.normal) > np.cos(MOST_OFF_PLANE)
    own = np.flatnonzero(own)
    names, count = np.unique(triangle[own], return_counts=True)
    names = names[count >= LEAST]
    if len(names) > MOST:
        return none
    found = {}
    for name in names:
        index = own[triangle[own] == name]
        by = _facet(Views.of(field, samples, index), samples.frame[index] % 2 == 0, mirror.normal.astype(np.float64))
        if by is not None:
            found[name] = by
    return (np.int32(list(found)), np.stack(list(found.values()))) if found else none


def _facet(views: Views, fitted: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
    """The way ((3,) float32) that one triangle faces; None where the mirror's own explains held-out frames as well.

    `fitted` ((m,) bool) are the observations that it is searched with; the others are held out.
    """
    sides = sides_of(normal)

    def evenly(index: np.ndarray, most: int) -> Views:
        return views.part(index[:: -(-len(index) // most)])

    search, held = evenly(np.flatnonzero(fitted), SEARCHED), evenly(np.flatnonzero(~fitted), FITTED)
    steps = np.arange(-STEEPEST, STEEPEST + STEP / 2, STEP)
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)
    off = [search.off(turned(normal, sides, by)) for by in grid]
    best = grid[int(np.argmin(off))]
    if not np.isfinite(min(off)) or not best.any():
        return None
    plane, facet = held.off(np.float32(normal)), held.off(turned(normal, sides, best))
    if not facet < BETTER * plane:
        return None
    every = evenly(np.arange(len(views)), FITTED)
    first = best + STEP / 2 * np.array([[0, 0], [1, 0], [0, 1]])
    how = {"initial_simplex": first, "maxfev": TRIALS, "xatol": 2e-4, "fatol": 1e-4}
    return turned(normal, sides, minimize(lambda by: every.off(turned(normal, sides, by)), best,
                                          method="Nelder-Mead", options=how).x)  # fmt: skip
