"""Which side of a triangle is the front: the one that the frames see. A scan's winding can't be relied on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..capture.model import Camera, Mesh
from .rays import RayScene

PIXEL_STEP = 4
"""Every fourth pixel in x and y votes."""


def seen_sides(mesh: Mesh, normal: np.ndarray, scene: RayScene, cameras: Sequence[Camera]) -> tuple[np.ndarray, float]:
    """Turn normals towards the cameras that see them.

    Triangles that no ray meets follow the majority of their object.

    Parameters
    ----------
    normal : (t, 3) float32
        By the winding.

    Returns
    -------
    (t,) float32
        +1 keep, -1 turn.
    footprint : float
        Edge in metres of the surface that a pixel covers: the lower quartile over all rays that hit.
    """
    votes = np.zeros(len(mesh.triangles))
    footprints = []
    for camera in cameras:
        y, x = np.mgrid[PIXEL_STEP // 2 : camera.height : PIXEL_STEP, PIXEL_STEP // 2 : camera.width : PIXEL_STEP]
        directions = camera.directions(np.stack([x.ravel() + 0.5, y.ravel() + 0.5], -1))
        hits = scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), directions.shape), directions)
        hit = hits.triangle >= 0
        triangle = hits.triangle[hit]
        cosine = -np.einsum("ij,ij->i", directions[hit], normal[triangle])
        votes += np.bincount(triangle, weights=cosine, minlength=len(votes))
        footprints.append(hits.distance[hit] / np.float32(np.sqrt(camera.fx * camera.fy)))
    by_object = np.bincount(mesh.object_id, weights=np.sign(votes), minlength=int(mesh.object_id.max()) + 1)
    sign = np.where(votes != 0, np.sign(votes), np.where(by_object[mesh.object_id] < 0, -1.0, 1.0))
    together = np.concatenate(footprints) if footprints else np.zeros(0, np.float32)
    footprint = float(np.percentile(together, 25)) if len(together) else 0.0
    return sign.astype(np.float32), footprint
