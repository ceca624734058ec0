"""Objects for a mesh that names none: its connected parts."""

import numpy as np
from scipy.spatial import cKDTree

from ..significance import LEVELS
from .params import SURFACE
from .uv_islands import connected
from .weld import weld


def connected_parts(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The part that each triangle belongs to, (t,) int64 from 0, the greatest surface first.

    Triangles that share a vertex are of one part. Crumbs join the nearest other part, and so does what is
    beyond `LEVELS.most`.

    Parameters
    ----------
    vertices : (v, 3) float
    triangles : (t, 3) int
        At least one; vertices used are finite.
    """
    part = connected_pieces(vertices, triangles)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    surface = np.bincount(part, area)
    order = np.argsort(-surface, kind="stable")
    largest = order[: max(int((surface[order[: LEVELS.most]] >= SURFACE.tiny * surface.sum()).sum()), 1)]
    number = np.full(len(surface), -1)
    number[largest] = np.arange(len(largest))
    return to_nearest(number[part], (a + b + c) / 3)


def connected_pieces(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The piece of each of some triangles ((t, 3) int), (t,) int64 from 0: those that share a vertex are of one."""
    used, corners = np.unique(triangles.ravel(), return_inverse=True)
    return connected(weld(vertices[used])[corners.ravel()].reshape(-1, 3))


def to_nearest(part: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Parts ((t,) int), each triangle that has none (-1) joined to that of the nearest `centre` ((t, 3))."""
    loose = np.flatnonzero(part < 0)
    if not len(loose):
        return part
    known, result = np.flatnonzero(part >= 0), part.copy()
    result[loose] = part[known[cKDTree(centre[known]).query(centre[loose])[1]]]
    return result
