"""Planes of an object that were measured in part, and the picture of each: cells as the atlas's texels lie in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ...scene.atlas import Atlas
from ...scene.elements import Unwrapped
from ...scene.model import Mesh
from ...scene.params import COPLANAR
from ...scene.tangent_frame import tangent_frame
from ...significance import LEVELS
from .params import TEXTURE


@dataclass(frozen=True)
class Texels:
    """Texels k of an atlas's images, islands' borders included, with their place on the surface.

    Attributes
    ----------
    texel : (k,) int64
        Flat index.
    element : (k,) int
        Whose value they show.
    position : (k, 3) float64
        Metres; a border's in the plane of the triangle beside it.
    edge : (k,) float64
        Metres.
    """

    texel: np.ndarray
    element: np.ndarray
    position: np.ndarray
    edge: np.ndarray

    def part(self, index: np.ndarray) -> Texels:
        """The texels at `index`."""
        return Texels(self.texel[index], self.element[index], self.position[index], self.edge[index])


def texels_of(atlas: Atlas, mesh: Mesh, wanted: np.ndarray) -> Texels:
    """The texels that show one of some elements ((n,) bool), on triangles of some size."""
    shows_wanted = np.append(wanted, False)[atlas.padding]  # -1: none
    texel = np.flatnonzero(shows_wanted)
    size = atlas.size
    triangles = np.flatnonzero(np.isin(mesh.object_id, np.unique(atlas.object_id[wanted])))
    corner = atlas.uv[triangles].astype(np.float64) * size
    large = np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])) > 2 * TEXTURE.least
    triangles = triangles[large]
    if not len(triangles):
        return Texels(texel[:0], texel[:0], np.zeros((0, 3)), np.zeros(0))
    triangle = np.full(size * size, -1, np.int32)
    triangle[texel] = np.append(triangles, -1)[Unwrapped(atlas.uv[triangles], size).at(texel, np.zeros(2)).triangle]
    # A border's texels, beside a triangle: what is shown between two texels is the mean of both.
    border = texel[triangle[texel] < 0]
    nearest = triangle[border]
    for step in (1, -1, size, -size, size + 1, size - 1, 1 - size, -1 - size):
        neighbour = border + step
        inside = (neighbour >= 0) & (neighbour < len(triangle))
        nearest = np.where((nearest < 0) & inside, triangle[np.where(inside, neighbour, 0)], nearest)
    triangle[border] = nearest
    element, owner = atlas.padding[texel], triangle[texel]
    valid = owner >= 0
    valid[valid] = mesh.object_id[owner[valid]] == atlas.object_id[element[valid]]
    texel, element, owner = texel[valid], element[valid], owner[valid]
    owners, index = np.unique(owner, return_inverse=True)
    origin, along = texel_axes(atlas, mesh, owners)
    edge = np.sqrt(np.linalg.norm(np.cross(along[..., 0], along[..., 1]), axis=1))[index]
    at = np.stack([texel % size, texel // size], 1) + 0.5
    position = origin[index] + along[index, :, 0] * at[:, :1] + along[index, :, 1] * at[:, 1:]
    return Texels(texel, element, position, edge)


def texel_axes(atlas: Atlas, mesh: Mesh, triangle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How the atlas lies on triangles ((k,) int): the position is origin + along @ (column, row).

    Returns
    -------
    origin : (k, 3) float64
    along : (k, 3, 2) float64
        Metres a texel; 0 where the triangle has no area in the atlas.
    """
    corner = mesh.vertices[mesh.triangles[triangle]].astype(np.float64)
    at = atlas.uv[triangle].astype(np.float64) * atlas.size
    (a, b), (c, d) = np.moveaxis(at[:, 1:] - at[:, :1], 0, 2)
    area = a * d - b * c
    inverse = np.stack([np.stack([d, -b], 1), np.stack([-c, a], 1)], 2) / np.where(area, area, np.inf)[:, None, None]
    along = (corner[:, 1:] - corner[:, :1]).transpose(0, 2, 1) @ inverse
    return corner[:, 0] - np.einsum("kij,kj->ki", along, at[:, 0]), along


@dataclass(frozen=True)
class Plane:
    """A plane of an object.

    Attributes
    ----------
    normal : (3,) float64
        Unit.
    offset : float
        Along the normal, metres.
    members : (m,) int
        Elements in it.
    """

    normal: np.ndarray
    offset: float
    members: np.ndarray

    def near(self, position: np.ndarray) -> np.ndarray:
        """Points ((k, 3)) that lie in it, (k,) bool."""
        return np.abs(position @ self.normal - self.offset) < COPLANAR.off


def planes_of(atlas: Atlas, elements: np.ndarray, filled: np.ndarray) -> Iterator[Plane]:
    """Planes of an object's `elements` ((m,) int), by how much of them is `filled` ((n,) bool), most first."""
    normal, position = atlas.normal[elements].astype(np.float64), atlas.position[elements].astype(np.float64)
    weight = np.where(filled[elements], atlas.area[elements], 0).astype(np.float64)
    min_area, rng = LEVELS.many * atlas.texel_edge**2, np.random.default_rng(0)

    def within(direction: np.ndarray, offset: float, index: np.ndarray) -> np.ndarray:
        off = np.abs(position[index] @ direction - offset)
        return (normal[index] @ direction > np.cos(COPLANAR.turn)) & (off < COPLANAR.off)

    remaining = np.ones(len(elements), bool)
    for _ in range(TEXTURE.planes):
        total = (weight * remaining).sum()
        if total < min_area:
            return
        drawn = rng.choice(len(elements), LEVELS.sample, p=weight * remaining / total)
        inliers = [within(normal[k], float(position[k] @ normal[k]), drawn) for k in drawn[: TEXTURE.tries]]
        best = drawn[max(inliers, key=np.count_nonzero)]
        direction = normal[best].mean(0)
        direction /= np.linalg.norm(direction)
        offset = float(np.median(position[best] @ direction))
        members = np.flatnonzero(remaining)
        members = members[within(direction, offset, members)]
        if weight[members].sum() < min_area:
            return
        remaining[members] = False
        yield Plane(direction, offset, elements[members])


@dataclass(frozen=True)
class Picture:
    """The cells of a plane's picture.

    Attributes
    ----------
    shape : (2,) tuple of int
    cell : (m,) int
        Flat index of the cell of each measured element.
    texel : (k,) int64
        Flat index of the texels that are wanted, in the atlas's image.
    wanted : (k,) int
        The flat index of the cell of each.
    """

    shape: tuple[int, int]
    cell: np.ndarray
    texel: np.ndarray
    wanted: np.ndarray

    @classmethod
    def of(cls, atlas: Atlas, mesh: Mesh, known: np.ndarray, wanted: Texels) -> Picture:
        """The picture of a plane's elements `known` ((m,) int), and of what is wanted in it and around."""
        axes = _axes(atlas, mesh, known)
        cells, targets = (np.asarray(points, np.float64) @ axes for points in (atlas.position[known], wanted.position))
        low, high = cells.min(0), cells.max(0)
        size, reach = 1 / np.sqrt(np.linalg.norm(np.cross(*axes.T))), high - low
        inside = ((targets >= low - reach) & (targets <= high + reach)).all(1) & (wanted.edge < TEXTURE.stretch * size)
        grid = np.concatenate([cells, targets[inside]])
        # Rounded, not cut off: where texels and cells are the same each texel lies in the middle of its cell.
        grid = np.rint(grid - grid.min(0)).astype(np.int64)
        coarser = int(np.ceil(np.sqrt(np.prod(grid.max(0) + 1.0) / TEXTURE.cells)))
        grid //= coarser
        shape = (int(grid[:, 0].max()) + 1, int(grid[:, 1].max()) + 1)
        flat = grid[:, 0] * shape[1] + grid[:, 1]
        return cls(shape, flat[: len(cells)], wanted.texel[inside], flat[len(cells) :])

    def paint(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values of the measured elements ((m, c)) as a picture, (h, w, c) float32, and the cells that have one.

        Cells between others, as where charts meet, take the mean of those around.
        """
        count = self.shape[0] * self.shape[1]
        hits = np.bincount(self.cell, minlength=count).reshape(self.shape)
        known = hits > 0
        around = ndimage.uniform_filter(known.astype(np.float32), 3, mode="constant")
        gap = ~known & (around > 0.5)
        channels = []
        for value in values.T:
            mean = np.bincount(self.cell, value, count).reshape(self.shape) / np.maximum(hits, 1)
            mean[gap] = ndimage.uniform_filter(mean, 3, mode="constant")[gap] / around[gap]
            channels.append(mean.astype(np.float32))
        return np.stack(channels, -1), known | gap

    @property
    def hole(self) -> np.ndarray:
        """Cells that are wanted, (h, w) bool."""
        return np.bincount(self.wanted, minlength=self.shape[0] * self.shape[1]).reshape(self.shape) > 0


def _axes(atlas: Atlas, mesh: Mesh, known: np.ndarray) -> np.ndarray:
    """What positions are multiplied by to have the cells' rows and columns, (3, 2) float64.

    The atlas's own texels on the largest triangle: nothing is resampled there.
    """
    triangle = np.unique(atlas.triangle[known])
    largest = triangle[mesh.geometry[1][triangle].argmax()]
    along = texel_axes(atlas, mesh, np.array([largest]))[1][0]
    length = np.linalg.norm(along, axis=0)
    square = length.max() < TEXTURE.stretch * length.min() and abs(along[:, 0] @ along[:, 1]) < 0.1 * length.prod()
    if not square or not 1 / TEXTURE.stretch < length.mean() / atlas.texel_edge < TEXTURE.stretch:
        normal = mesh.geometry[0][largest : largest + 1]
        along = np.stack([tangent[0] for tangent in tangent_frame(normal)], 1).astype(np.float64) * atlas.texel_edge
    return np.linalg.pinv(along).T
