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


class MeshView(NamedTuple):
    """What the mesh shows in a view: (height, width) each; distance inf and triangle -1 where nothing."""

    triangle: np.ndarray
    distance: np.ndarray
    edge: np.ndarray


def mesh_view(camera: Camera, mesh: Mesh, scene: RayScene, bends: bool = True) -> MeshView:
    """Trace a view and find the mesh's edges: steps in depth, `bends`, borders of objects.

    Of a mesh that was fused from depth bends are none: most of them are noise.
    """
    directions = camera.directions(camera.pixel_centres())
    hits = scene.intersect(camera.centre, directions)
    shape = camera.height, camera.width
    triangle, distance = hits.triangle.reshape(shape), hits.distance.reshape(shape)
    hit = triangle >= 0
    facing = np.where(hit[..., None], mesh.geometry[0][triangle], 0)
    edge = np.zeros(shape, bool)
    for pixel, neighbour in (((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
                       ((slice(1, None), slice(None)), (slice(None, -1), slice(None)))):  # fmt: skip
        both_hit = hit[pixel] & hit[neighbour]
        nearer, farther = (f(distance[pixel], distance[neighbour]) for f in (np.minimum, np.maximum))
        with np.errstate(invalid="ignore"):
            step = farther > (1 + AGREEMENT.jump) * nearer
        # a triangle's normal has no side: scans are wound as it happens
        is_bend = np.abs((facing[pixel] * facing[neighbour]).sum(-1)) < AGREEMENT.bend
        edge[pixel] |= (both_hit & is_bend & bends) | step | (hit[pixel] != hit[neighbour])
    return MeshView(triangle, distance, edge)


def edge_score(views: Sequence[SmallView], mesh_views: Sequence[MeshView]) -> float:
    """Probability that the picture changes more at an edge of the mesh than elsewhere: 0.5 by chance; NaN: no edges."""
    on_edges, elsewhere = [], []
    for view, mesh in zip(views, mesh_views, strict=True):
        change = np.hypot(*np.gradient(view.log.mean(-1)))  # NaN where unknown
        known = np.isfinite(change)
        rank = np.full(change.shape, np.nan)
        rank[known] = np.argsort(np.argsort(change[known])) / max(known.sum(), 1)
        rank = maximum_filter(np.where(known, rank, 0), 3)
        on_edges.append(rank[mesh.edge & known])
        elsewhere.append(rank[~mesh.edge & known])
    a, b = np.concatenate(on_edges or [np.zeros(0)]), np.sort(np.concatenate(elsewhere or [np.zeros(0)]))
    if len(a) < LEVELS.many or len(b) < LEVELS.many:
        return float("nan")
    return float(np.searchsorted(b, a).mean() / len(b))
