"""Bright triangles: where a share of the rays is aimed. Lamps, and anything else that shines like one."""

from dataclasses import dataclass

import numpy as np

from ..luminance import LUMINANCE
from ..scene.rays import Hits
from .field import LightField
from .params import GATHER


@dataclass(frozen=True)
class BrightTriangles:
    """Triangles that rays are aimed at.

    Attributes
    ----------
    triangle : (k,) int32
        Which of the mesh's they are.
    corner, edge_u, edge_v : (k, 3) float32
    normal : (k, 3) float32
    reached : (k,) float64
        Sum of the chances of being aimed at, up to each. They sum to 1, in proportion to area * luminance.
    density : (t,) float32
        Chance over area for every triangle of the mesh: density of aimed points per square metre; 0 if not bright.
    """

    triangle: np.ndarray
    corner: np.ndarray
    edge_u: np.ndarray
    edge_v: np.ndarray
    normal: np.ndarray
    reached: np.ndarray
    density: np.ndarray

    def __len__(self) -> int:
        return len(self.triangle)


def triangle_luminance(field: LightField) -> np.ndarray:
    """Mean luminance of each triangle over its elements ((t,) float64).

    A triangle too small for elements of its own, as in a finely meshed bulb, shows those of its object beside it.
    """
    atlas = field.atlas
    luminance = field.radiance @ LUMINANCE
    t = len(field.mesh.triangles)
    mean = np.bincount(atlas.triangle, luminance, t) / np.maximum(np.bincount(atlas.triangle, minlength=t), 1)
    bare, neighbour = field.lookup.bare
    mean[bare] = luminance[neighbour]
    return mean


def bright_triangles(field: LightField) -> BrightTriangles:
    """The triangles that give most of the light for their size."""
    weight = field.atlas.weight
    mean = (field.radiance @ LUMINANCE * weight).sum() / max(weight.sum(), 1e-30)
    return shining(field, GATHER.bright * mean)


def shining(field: LightField, above: float = 0.0) -> BrightTriangles:
    """The triangles of a luminance above this: those that give most light, if there are too many."""
    normal, area = field.mesh.geometry
    luminance = triangle_luminance(field)
    bright = np.flatnonzero((luminance > above) & (luminance * area > 0))
    power = luminance[bright] * area[bright]
    strongest = np.sort(np.argsort(-power)[: GATHER.max_triangles])
    bright, power = bright[strongest], power[strongest]
    chance = power / max(power.sum(), 1e-30)
    density = np.zeros(len(area), np.float32)
    density[bright] = chance / area[bright]
    corners = field.mesh.vertices[field.mesh.triangles[bright]].astype(np.float32)
    corner, edge_u, edge_v = corners[:, 0].copy(), corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return BrightTriangles(bright.astype(np.int32), corner, edge_u, edge_v, normal[bright], np.cumsum(chance), density)


def aimed_at(
    bright: BrightTriangles, hits: Hits, directions: np.ndarray, triangle_normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which rays met a bright triangle, and the solid-angle density with which aimed rays take their directions.

    Parameters
    ----------
    hits : Hits
        What the n directions met first.
    directions : (n, 3) float32
    triangle_normal : (t, 3) float32

    Returns
    -------
    (m,) int, (m,) float32
    """
    density = bright.density.take(hits.triangle)  # of an escaped ray that of the last triangle; taken out below
    hit = np.flatnonzero((density > 0) & (hits.triangle >= 0))
    normal = triangle_normal.take(hits.triangle.take(hit), 0)
    cosine = np.abs(np.einsum("ij,ij->i", directions.take(hit, 0), normal))
    return hit, density.take(hit) * hits.distance.take(hit) ** 2 / np.maximum(cosine, 1e-6)


def aimed_density(
    bright: BrightTriangles, hits: Hits, directions: np.ndarray, triangle_normal: np.ndarray
) -> np.ndarray:
    """The density of `aimed_at` for every ray, (n,) float32; 0 where no bright triangle was met."""
    density = np.zeros(len(directions), np.float32)
    if len(bright):
        hit, aimed = aimed_at(bright, hits, directions, triangle_normal)
        density[hit] = aimed
    return density


@dataclass(frozen=True)
class BrightPoints:
    """m points drawn on the bright triangles.

    Attributes
    ----------
    index : (m,) int
        Which of the bright triangles.
    triangle : (m,) int32
        The same as the mesh's triangle.
    u, v : (m,) float32
        Barycentric coordinates.
    point : (m, 3) float32
    density : (m,) float32
        With which the point was drawn, per square metre.
    """

    index: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    point: np.ndarray
    density: np.ndarray


def sample_bright(bright: BrightTriangles, cube: np.ndarray) -> BrightPoints:
    """Draw k points for each of n receivers, by numbers ((n, k, 3) float32) in [0, 1): which triangle, and where on it.

    Well spread in all three together, they spread over each lamp too.
    """
    flat = cube.reshape(-1, 3)
    index = np.minimum(np.searchsorted(bright.reached, flat[:, 0]), len(bright) - 1)
    root = np.sqrt(flat[:, 1])
    u, v = root * (1 - flat[:, 2]), root * flat[:, 2]  # uniform over the triangle
    corner, edge_u, edge_v = (part.take(index, 0) for part in (bright.corner, bright.edge_u, bright.edge_v))
    point = corner + u[:, None] * edge_u + v[:, None] * edge_v
    triangle = bright.triangle.take(index)
    return BrightPoints(index, triangle, u, v, point, bright.density.take(triangle))
