"""How noisy a scanned mesh is, and by how much its triangles are tilted for it."""

import numpy as np
from scipy import sparse

from ..significance import LEVELS
from .model import Mesh
from .params import NOISE
from .weld import point_normals, ring_of, welded


def noise_of(mesh: Mesh) -> float:
    """Standard deviation along the normal, in metres, of what is independent from vertex to vertex.

    From each vertex's height over its neighbours, less those neighbours' own: curvature, which neighbours share, is
    gone. The median over the vertices, so that creases don't count. (The living room with 3.5 mm: 3.8 mm.)
    """
    points, faces, _ = welded(mesh)
    ring = ring_of(faces, len(points))
    degree = np.asarray(ring.sum(1))[:, 0]
    inner = degree >= 4
    if inner.sum() < LEVELS.many:
        return 0.0
    share = sparse.diags(1 / np.maximum(degree, 1)) @ ring
    normal = point_normals(points, faces)
    height = ((points - share @ points) * normal).sum(1)
    second = height - share @ height
    # Of independent noise of 1: a vertex less the mean of d neighbours, twice.
    d = float(np.median(degree[inner]))
    return float(np.median(np.abs(second[inner])) / 0.6745 / np.sqrt((1 + 1 / d) ** 2 + 1 / d))


def tilt(mesh: Mesh, taken_out: float = 0.0) -> np.ndarray:
    """Standard deviation in radians by which noise tilts each triangle, (t,) float32; 0 for a mesh without noise.

    `taken_out` is the noise in metres that the mesh had before it was denoised; 0: it was not.
    That is about the relative error of the irradiance there: of light from one side, E changes with the cosine.
    """
    noise = NOISE.left * taken_out if taken_out else noise_of(mesh)
    if not taken_out and noise < NOISE.least_noise:
        return np.zeros(len(mesh.triangles), np.float32)
    corners = mesh.vertices[mesh.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).max(1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # A corner's error turns the triangle by its share of the height; the other two add a half of that each. What is
    # turned by pi faces any way.
    return np.minimum(np.sqrt(1.5) * noise * longest / np.maximum(area, 1e-30), np.pi).astype(np.float32)
