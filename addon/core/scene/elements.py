"""Surface elements: the atlas's texels with their place on the surface."""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from ..groups import by_number
from ..kinds import Block
from ..parallel import blocks, for_blocks
from .atlas import Atlas
from .model import Mesh
from .rays import Hits, RayScene
from .seen_cells import SeenCells
from .uv_islands import areas, connected, corner_ids

# Where in a texel the triangle that covers it is looked up: the centre first, so that a texel which only touches a
# triangle still gets an element at its border, and thin triangles are not lost.
SUBSAMPLES = np.array(
    [[0, 0], [-0.25, -0.25], [0.25, 0.25], [-0.25, 0.25], [0.25, -0.25],
     [-0.45, -0.45], [0.45, 0.45], [-0.45, 0.45], [0.45, -0.45], [0, 0.45], [0, -0.45], [0.45, 0], [-0.45, 0]],
    np.float32,
)  # fmt: skip
ROWS_AT_ONCE: Block[int] = 128


def uv_scale(mesh: Mesh, uv: np.ndarray) -> float:
    """Atlas units for one metre: root of UV area over surface area, over the whole mesh."""
    _, area = mesh.geometry
    return float(np.sqrt(areas(uv).sum() / max(area.sum(), 1e-30)))


class Unwrapped:
    """Triangles laid flat by their texture coordinates ((t, 3, 2)), for rays down onto texels of an image."""

    def __init__(self, uv: np.ndarray, size: int):
        self._size = size
        flat = np.concatenate([uv.reshape(-1, 2).astype(np.float64) * size, np.zeros((3 * len(uv), 1))], 1)
        self._scene = RayScene(flat, np.arange(3 * len(uv), dtype=np.int32).reshape(-1, 3))

    def at(self, texel: np.ndarray, shift: np.ndarray) -> Hits:
        """What lies under points of texels ((k,) flat indices), `shift` ((2,) texels) from their middles."""
        origins = np.empty((len(texel), 3), np.float32)
        origins[:, 0] = texel % self._size + 0.5 + shift[0]
        origins[:, 1] = texel // self._size + 0.5 + shift[1]
        origins[:, 2] = 1.0
        return self._scene.intersect(origins, np.broadcast_to(np.array([0, 0, -1], np.float32), origins.shape))


def _cover(uv: np.ndarray, size: int, threads: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Covered texels, the triangle over each and the barycentric point, by rays against the unwrapped mesh."""
    if not len(uv):
        return *np.zeros((2, 0), np.int32), *np.zeros((2, 0), np.float32)
    plane = Unwrapped(uv, size)
    triangle = np.full(size * size, -1, np.int32)
    u, v = np.zeros(size * size, np.float32), np.zeros(size * size, np.float32)

    def look_up(texels: np.ndarray, shift: np.ndarray) -> None:
        hits = plane.at(texels, shift)
        hit = hits.triangle >= 0
        hit_texels = texels[hit]
        triangle[hit_texels], u[hit_texels], v[hit_texels] = hits.triangle[hit], hits.u[hit], hits.v[hit]

    def centres(rows: slice) -> None:
        look_up(np.arange(rows.start * size, rows.stop * size), SUBSAMPLES[0])

    def partly(part: slice) -> None:
        for shift in SUBSAMPLES[1:]:
            look_up(candidates[part][triangle[candidates[part]] < 0], shift)

    for_blocks(centres, size, ROWS_AT_ONCE, threads)
    # Only empty texels beside a covered one, or under a triangle too small for any centre, can be covered in part; what
    # is found so has neighbours in turn, along a sliver's whole length.
    corners = np.clip((uv.reshape(-1, 2) * size).astype(np.int64), 0, size - 1)
    near = ndimage.binary_dilation((triangle >= 0).reshape(size, size), np.ones((3, 3), bool))
    near[corners[:, 1], corners[:, 0]] = True
    untested = triangle < 0
    candidates = np.flatnonzero(near.ravel() & untested)
    while len(candidates):
        untested[candidates] = False
        for_blocks(partly, len(candidates), 1 << 15, threads)
        covered = np.divmod(candidates[triangle[candidates] >= 0], size)
        rows, columns = (np.clip(index + np.array([-1, 0, 1])[:, None], 0, size - 1) for index in covered)
        neighbours = np.unique(rows[:, None] * size + columns[None])
        candidates = neighbours[untested[neighbours]]
    texel = np.flatnonzero(triangle >= 0).astype(np.int32)
    return texel, triangle[texel], u[texel], v[texel]


class Elements(NamedTuple):
    """What takes time to find of an atlas's elements: fields of `Atlas`."""

    texel: np.ndarray
    triangle: np.ndarray
    position: np.ndarray
    area: np.ndarray
    padding: np.ndarray


class Crumbs(NamedTuple):
    """Small triangles of which those of one cell share an element.

    Attributes
    ----------
    triangle : (k,) int
    cell : (k,) int
        From 0 on, each number in use.
    corner : (m, 2) int
        Column and row of the first of each cell's two by two texels.
    """

    triangle: np.ndarray
    cell: np.ndarray
    corner: np.ndarray


def find_elements(
    mesh: Mesh,
    uv: np.ndarray,
    size: int,
    coarse: SeenCells | None = None,
    crumbs: Crumbs | None = None,
    threads: int = 0,
) -> Elements:
    """The elements at the texels that `uv` covers.

    Parameters
    ----------
    mesh, uv, size
        See `make_atlas`.
    coarse : SeenCells, optional
        Where one element stands for many texels; not given: each texel has its own.
    crumbs : Crumbs, optional
        Triangles that have elements together.
    """
    has_texels = np.ones(len(uv), bool)
    if crumbs is not None:
        has_texels[crumbs.triangle] = False
    texel, triangle, u, v = _cover(uv if has_texels.all() else uv[has_texels], size, threads)
    triangle = np.flatnonzero(has_texels).astype(np.int32)[triangle]
    position = np.empty((len(texel), 3), np.float32)
    for part in blocks(len(texel), 1 << 18):
        a, b, c = (mesh.vertices[mesh.triangles[triangle[part], i]].astype(np.float64) for i in range(3))
        position[part] = a + u[part, None] * (b - a) + v[part, None] * (c - a)
    del u, v
    # Each triangle's surface is shared out between its texels; what no texel covers is left out.
    count = np.bincount(triangle, minlength=len(mesh.triangles))
    shared = (mesh.geometry[1][triangle] / count[triangle]).astype(np.float32)
    padding = np.full(size * size, -1, np.int32)
    padding[texel] = np.arange(len(texel), dtype=np.int32)
    elements, own = Elements(texel, triangle, position, shared, padding), len(texel)
    del texel, triangle, position, shared  # or they were held beside what is made of them
    if crumbs is not None and len(crumbs.triangle):
        elements = _with_crumbs(elements, mesh, size, crumbs)
    return _merged(elements._replace(padding=_padded(elements.padding, size)), own, coarse)


def _with_crumbs(elements: Elements, mesh: Mesh, size: int, crumbs: Crumbs) -> Elements:
    """Elements, and those of cells of crumbs after them."""
    middle = mesh.vertices[mesh.triangles[crumbs.triangle]].mean(1, dtype=np.float64)
    chosen = _nearest_to_middle(middle, crumbs.cell)
    texel = (crumbs.corner[:, 1] * size + crumbs.corner[:, 0]).astype(np.int32)
    area = np.bincount(crumbs.cell, mesh.geometry[1][crumbs.triangle]).astype(np.float32)
    padding = elements.padding
    padding[texel[:, None] + np.array([0, 1, size, size + 1])] = (
        len(elements.texel) + np.arange(len(texel), dtype=np.int32)[:, None]
    )
    of_crumbs = texel, crumbs.triangle[chosen].astype(np.int32), middle[chosen].astype(np.float32), area
    texel, triangle, position, area = (np.concatenate(both) for both in zip(elements[:-1], of_crumbs, strict=True))
    return Elements(texel, triangle, position, area, padding)


def _padded(element: np.ndarray, size: int) -> np.ndarray:
    """The element at each texel ((size * size,) int32), or the nearest one where it is -1."""
    empty = element.reshape(size, size) < 0
    row, column = ndimage.distance_transform_edt(empty, return_distances=False, return_indices=True)
    row *= size
    row += column
    return element.take(row.ravel())


def _nearest_to_middle(position: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Of each group ((n,) int, all in use) the point nearest to its middle, which may lie off the surface, (m,) int."""
    square_distance, count = np.zeros(len(position)), np.bincount(group)
    for axis in range(3):
        square_distance += np.square(position[:, axis] - (np.bincount(group, position[:, axis]) / count)[group])
    order = np.lexsort((square_distance, group))
    return order[np.cumsum(count) - count]


def _merged(elements: Elements, count: int, coarse: SeenCells | None) -> Elements:
    """Elements, by rising texel, of which one stands for all of its coarse cell; only the first `count` are merged."""
    separate = np.ones(len(elements.texel), bool)
    if coarse is not None:
        separate[:count] = coarse.seen(elements.position[:count], elements.triangle[:count])
    other = np.flatnonzero(~separate)
    if not len(other) and count == len(separate):
        return elements
    assert coarse is not None
    group = np.unique(coarse.coarse(elements.position[other], elements.triangle[other]), return_inverse=True)[1].ravel()
    chosen = other[_nearest_to_middle(elements.position[other], group)]
    separate[chosen] = True
    order = np.flatnonzero(separate)
    order = order[np.argsort(elements.texel[order], kind="stable")]
    number = np.empty(len(separate), np.int32)
    number[order] = np.arange(len(order), dtype=np.int32)
    number[other] = number[chosen][group]
    parts = (elements.texel[order], elements.triangle[order], elements.position[order])
    return Elements(*parts, np.bincount(number, elements.area).astype(np.float32), number[elements.padding])


def make_atlas(mesh: Mesh, uv: np.ndarray, size: int, known: Elements | None = None) -> Atlas:
    """Surface elements at the texels that `uv` covers.

    Parameters
    ----------
    uv : (t, 3, 2) float32
        Atlas coordinates in [0, 1], without overlap.
    size : int
        Edge of the atlas in texels.
    known : Elements, optional
        Of the same atlas; not given: each texel has its own.
    """
    elements = known or find_elements(mesh, uv, size)
    normal, _ = mesh.geometry
    return Atlas(
        size=size,
        uv=uv,
        normal=normal[elements.triangle],
        object_id=mesh.object_id[elements.triangle],
        back=None if mesh.backs is None else elements.triangle >= len(mesh.triangles) - len(mesh.backs),
        **elements._asdict(),
    )


def element_of_triangle(mesh: Mesh, atlas: Atlas) -> np.ndarray:
    """An element for each triangle, (t,) int32: its own, else the nearest one of the same object, else the nearest."""
    first = np.full(len(mesh.triangles), -1, np.int32)
    first[atlas.triangle[::-1]] = np.arange(len(atlas) - 1, -1, -1, dtype=np.int32)
    # What lies under its middle in the atlas: beside its own texels, or the one element of many.
    bare = np.flatnonzero(first < 0)
    below = _under(atlas, bare)
    first[bare] = np.where(atlas.object_id[below] == mesh.object_id[bare], below, -1)
    centroid = mesh.vertices[mesh.triangles].mean(1)
    missing = np.flatnonzero(first < 0)
    for object_id, group in by_number(mesh.object_id[missing]).items():
        bare, elements = missing[group], atlas.elements_of(object_id)
        if not len(elements):
            elements = np.arange(len(atlas))
        first[bare] = elements[cKDTree(atlas.position[elements]).query(centroid[bare])[1]]
    return first


def _under(atlas: Atlas, triangle: np.ndarray) -> np.ndarray:
    """The element whose texel lies under the middle of each triangle in the atlas, (k,) int32."""
    middle = atlas.uv[triangle].mean(1, dtype=np.float64) * atlas.size
    column, row = np.clip(middle.astype(np.int64), 0, atlas.size - 1).T
    return atlas.padding[row * atlas.size + column]


def shown_uv(mesh: Mesh, atlas: Atlas) -> np.ndarray:
    """Atlas coordinates for a renderer, which looks texels up and no elements, (t, 3, 2) float32.

    An island too small for a texel would show another object's: it lies in the middle of the one that stands for it.
    """
    foreign = atlas.object_id[_under(atlas, np.arange(len(mesh.triangles)))] != mesh.object_id
    if not foreign.any():
        return atlas.uv
    touched = np.zeros(len(mesh.vertices), bool)
    touched[mesh.triangles[foreign]] = True
    near = np.flatnonzero(touched[mesh.triangles].any(1))
    island = connected(corner_ids(mesh.triangles[near], atlas.uv[near]))
    invisible = np.bincount(island, ~foreign[near]) == 0
    first = near[np.unique(island, return_index=True)[1]]
    texel = atlas.texel[element_of_triangle(mesh, atlas)[first]]
    middle = np.stack([texel % atlas.size, texel // atlas.size], 1) + 0.5
    uv, moved = atlas.uv.copy(), invisible[island]
    uv[near[moved]] = (middle / atlas.size)[island[moved], None]
    return uv


class ElementLookup:
    """The element at points on the surface, made ready for many millions of them."""

    def __init__(self, mesh: Mesh, atlas: Atlas):
        self._atlas, self._object_id = atlas, mesh.object_id
        self._of_triangle = element_of_triangle(mesh, atlas)
        # Atlas coordinates in texels are linear in the barycentric ones: x + u dx_u + v dx_v, and y alike.
        corners = atlas.uv.astype(np.float64) * atlas.size
        edges = corners[:, 1:] - corners[:, :1]
        self._map = np.concatenate([corners[:, 0], edges.transpose(0, 2, 1).reshape(-1, 4)], 1).astype(np.float32)
        # A triangle too small for a texel of its own may show another object's: those alone are looked at closely.
        self._close = np.bincount(atlas.triangle, minlength=len(mesh.triangles)) == 0
        all_triangles = np.arange(len(mesh.triangles))
        for u, v in ((0.01, 0.01), (0.98, 0.01), (0.01, 0.98), (1 / 3, 1 / 3)):
            point = np.full((2, len(all_triangles)), ((u,), (v,)), np.float32)
            self._close |= atlas.object_id[self._texel(all_triangles, *point)] != mesh.object_id

    @cached_property
    def bare(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangles without an element of their own, (k,) int32, and the element in the middle of each, (k,) int32."""
        bare = np.flatnonzero(np.bincount(self._atlas.triangle, minlength=len(self._object_id)) == 0).astype(np.int32)
        third = np.full(len(bare), 1 / 3, np.float32)
        return bare, self(bare, third, third)

    def _texel(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The element whose texel the points fall in."""
        size = self._atlas.size
        x, y, x_u, x_v, y_u, y_v = self._map.take(triangle, 0).T
        column = (x + u * x_u + v * x_v).astype(np.int32)
        row = (y + u * y_u + v * y_v).astype(np.int32)
        return self._atlas.padding.take(np.minimum(row, size - 1) * size + np.minimum(column, size - 1))

    def __call__(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The element at each point, (n,) int32, by triangle (>= 0) and barycentric coordinates as in `rays.Hits`."""
        element = self._texel(triangle, u, v)
        close = np.flatnonzero(self._close.take(triangle))
        foreign = close[self._atlas.object_id[element[close]] != self._object_id[triangle[close]]]
        element[foreign] = self._of_triangle[triangle[foreign]]
        return element
