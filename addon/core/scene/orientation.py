"""Which side of a triangle is the front: the one that the frames see. A scan's winding can't be relied on."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .model import Camera, Mesh
from .params import SIDES
from .rays import RayScene
from .sparse_hits import pixel_edges, sparse_hits
from .two_sides import substantial, two_sided


class Sides(NamedTuple):
    """Which sides of the t triangles the frames see.

    Attributes
    ----------
    sign : (t,) float32
        +1 keep the winding, -1 turn it.
    footprint : float
        Edge in metres of the surface that a pixel covers: the lower quartile over all rays that hit.
    both : (t,) bool
        Triangles whose two sides are seen, each alone or as parts of a sheet (`two_sides.two_sided`).
    """

    sign: np.ndarray
    footprint: float
    both: np.ndarray


def seen_sides(mesh: Mesh, cameras: Sequence[Camera]) -> Sides:
    """Turn normals towards the cameras that see them.

    Triangles that no ray meets follow the majority of their object.
    """
    normal, scene = mesh.geometry[0], RayScene(mesh.vertices, mesh.triangles)
    votes = np.zeros(len(mesh.triangles))
    sides = np.zeros((2, len(votes)), np.int64)  # rays that hit the front, and the back
    footprints = []
    for camera in cameras:
        pixels, directions, hits = sparse_hits(scene, camera)
        triangle = hits.triangle
        cosine = -np.einsum("ij,ij->i", directions, normal[triangle])
        votes += np.bincount(triangle, weights=cosine, minlength=len(votes))
        for side, hit in zip(sides, (cosine > 0, cosine < 0), strict=True):
            side += np.bincount(triangle[hit], minlength=len(votes))
        edges = pixel_edges(camera, pixels, hits)
        footprints.append(edges[edges > 0])
    by_object = np.bincount(mesh.object_id, weights=np.sign(votes), minlength=int(mesh.object_id.max()) + 1)
    sign = np.where(votes != 0, np.sign(votes), np.where(by_object[mesh.object_id] < 0, -1.0, 1.0))
    all_footprints = np.concatenate(footprints) if footprints else np.zeros(0, np.float32)
    footprint = float(np.percentile(all_footprints, 25)) if len(all_footprints) else 0.0
    both = sides.min(0) >= np.maximum(SIDES.least_share * sides.sum(0), SIDES.least_rays)
    if sides[0].any() and sides[1].any():
        sheets, turned = two_sided(mesh, sides)
        both = substantial(mesh, both | sheets)
        sign = np.where(both & sheets, turned, sign)
    return Sides(sign.astype(np.float32), footprint, both)
