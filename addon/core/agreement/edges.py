"""Do the mesh's edges lie on the pictures' edges, and if not, how many pixels beside them?"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from ..scene.model import Camera, Mesh
from ..scene.rays import RayScene
from ..significance import LEVELS
from .params import AGREEMENT
from .views import SmallView


class Shown(NamedTuple):
    """What the mesh shows in a view: (height, width) each; distance inf and triangle -1 where nothing."""

    triangle: np.ndarray
    distance: np.ndarray
    edge: np.ndarray


def shown(camera: Camera, mesh: Mesh, scene: RayScene, bends: bool = True) -> Shown:
    """Trace a view and find the mesh's edges: steps in depth, bends, borders of objects.

    Parameters
    ----------
    bends : bool
        Not so in a mesh that was fused from depth: most of its bends are noise.
    """
    directions = camera.directions(camera.pixel_centres())
    hits = scene.intersect(camera.centre, directions)
    shape = camera.height, camera.width
    triangle, distance = hits.triangle.reshape(shape), hits.distance.reshape(shape)
    hit = triangle >= 0
    facing = np.where(hit[..., None], mesh.geometry[0][triangle], 0)
    edge = np.zeros(shape, bool)
    for own, other in (((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
                       ((slice(1, None), slice(None)), (slice(None, -1), slice(None)))):  # fmt: skip
        both = hit[own] & hit[other]
        near, far = (f(distance[own], distance[other]) for f in (np.minimum, np.maximum))
        with np.errstate(invalid="ignore"):
            step = far > (1 + AGREEMENT.jump) * near
        # a triangle's normal has no side: scans are wound as it happens
        bent = np.abs((facing[own] * facing[other]).sum(-1)) < AGREEMENT.bend
        edge[own] |= (both & bent & bends) | step | (hit[own] != hit[other])
    return Shown(triangle, distance, edge)


def edge_score(views: Sequence[SmallView], seen: Sequence[Shown]) -> float:
    """Probability that the picture changes more at an edge of the mesh than elsewhere: 0.5 by chance; NaN: no edges."""
    at, off = [], []
    for view, one in zip(views, seen, strict=True):
        change = np.hypot(*np.gradient(view.log.mean(-1)))  # NaN where unknown
        known = np.isfinite(change)
        rank = np.full(change.shape, np.nan)
        rank[known] = np.argsort(np.argsort(change[known])) / max(known.sum(), 1)
        rank = maximum_filter(np.where(known, rank, 0), 3)
        at.append(rank[one.edge & known])
        off.append(rank[~one.edge & known])
    a, b = np.concatenate(at or [np.zeros(0)]), np.sort(np.concatenate(off or [np.zeros(0)]))
    if len(a) < LEVELS.many or len(b) < LEVELS.many:
        return float("nan")
    return float(np.searchsorted(b, a).mean() / len(b))
