"""Where in the atlas lies what frames resolve coarsely or not at all: few texels each, placed without an unwrap.

What is smaller than its coarse cell (`seen_cells`) shares the cell's block of two by two texels, which show one element
between their centres. Larger triangles lie apart, each with a texel as wide as half a cell. No two triangles overlap.
"""

import numpy as np

from .elements import Crumbs
from .model import Mesh
from .pages import shelves
from .params import SPARSE, SURFACE
from .seen_cells import SeenCells


class Sparse:
    """The triangles that are laid out sparsely, and how wide their texels are to be.

    Parameters
    ----------
    texel : float
        Edge of the room's elements, metres.

    Attributes
    ----------
    triangle : (k,) int
        Sorted.
    edge : (t,) float64
        Of a texel, metres.
    """

    def __init__(self, mesh: Mesh, cells: SeenCells, texel: float):
        self._mesh, self._cells = mesh, cells
        corner = mesh.vertices[mesh.triangles]
        self._corner, self._middle = corner, corner.mean(1)
        all_triangles = np.arange(len(mesh.triangles))
        seen = cells.met.copy()
        for point in (self._middle, *corner.transpose(1, 0, 2)):
            seen |= cells.seen(point, all_triangles)
        _, area = mesh.geometry
        side = np.sqrt(area)
        # Half a cell, so that a triangle apart is about as fine as the cells are.
        coarse_edge = cells.coarse_edge(self._middle, cells.coarser)
        edge = np.where(seen, texel, coarse_edge / 2)
        edge = np.maximum(edge, np.where(seen, 0, side / SPARSE.large))
        large = np.flatnonzero(seen & (side > SPARSE.large * texel))
        coarse = texel * side[large] / np.sqrt(SPARSE.seen_part * cells.area_met(large))
        edge[large] = np.where(coarse > 2 * texel, coarse, texel)
        self.edge = edge
        longest = np.max([np.linalg.norm(corner[:, k] - corner[:, k - 1], axis=1) for k in range(3)], 0)
        self._small = longest <= np.where(seen, SPARSE.fine * texel, 2 * coarse_edge)
        self._seen = seen
        self.triangle = np.flatnonzero((edge > 1.5 * texel) | self._small)

    def placed(self, width: int, coarser: float) -> tuple[np.ndarray, int, Crumbs]:
        """Placed in a strip so wide, texels `coarser` times as wide as wanted.

        Returns
        -------
        uv : (k, 3, 2) float64
            In texels of the strip.
        height : int
            Of the strip, in texels.
        crumbs : Crumbs
            Those that share a block, in texels of the strip.
        """
        chosen = self.triangle
        uv = np.zeros((len(chosen), 3, 2))
        apart = np.flatnonzero(~self._small[chosen])
        flat = flattened(self._corner[chosen[apart]]) / (coarser * self.edge[chosen[apart], None, None])
        box = np.ceil(flat.max(1)) + SURFACE.margin
        place, _, top = shelves(np.minimum(box, width), width)
        squeeze = np.minimum(1, (width - SURFACE.margin) / np.maximum(box[:, 0] - SURFACE.margin, 1))
        uv[apart] = flat * squeeze[:, None, None] + place[:, None] + SURFACE.margin / 2
        top = -(-int(top) // SPARSE.block) * SPARSE.block
        small = np.flatnonzero(self._small[chosen])
        middle = self._middle[chosen[small]]
        number = self._cells.coarse(
            middle, chosen[small], np.where(self._seen[chosen[small]], 1 / SPARSE.coarse, coarser)
        )
        names, first, cell = np.unique(number, return_index=True, return_inverse=True)
        cell = cell.ravel()
        # Side by side are those of one object that lie close, so that smaller copies of an image mix what is alike.
        order = np.lexsort((along_curve(middle[first]), self._mesh.object_id[chosen[small[first]]]))
        row, column = np.divmod(np.argsort(order), width // SPARSE.block)
        corner = np.stack([column * SPARSE.block, top + row * SPARSE.block], 1)
        uv[small] = tiled(cell) + 0.5 + corner[cell][:, None]
        height = top + SPARSE.block * -(-len(names) // (width // SPARSE.block))
        return uv, height, Crumbs(chosen[small], cell, corner)


def flattened(corner: np.ndarray) -> np.ndarray:
    """Triangles ((n, 3, 3)) laid flat from 0 on, their longest edge along x, (n, 3, 2) float64."""
    corner = corner.astype(np.float64)
    length = np.stack([np.linalg.norm(corner[:, (k + 1) % 3] - corner[:, k], axis=1) for k in range(3)], 1)
    first = length.argmax(1)
    index = np.arange(len(corner))
    a, b, c = (corner[index, (first + k) % 3] for k in range(3))
    along = (b - a) / np.maximum(length[index, first], 1e-30)[:, None]
    x = np.einsum("ij,ij->i", c - a, along)
    y = np.linalg.norm(c - a - x[:, None] * along, axis=1)
    result = np.zeros((len(corner), 3, 2))
    result[index, (first + 1) % 3, 0] = length[index, first]
    result[index, (first + 2) % 3] = np.stack([x, y], 1)
    return result


def tiled(group: np.ndarray) -> np.ndarray:
    """A triangle of the unit square for each of n, (n, 3, 2) float64; those of one `group` ((n,) int) don't overlap."""
    order = np.argsort(group, kind="stable")
    count = np.bincount(group)
    start = np.cumsum(count) - count
    rank = np.argsort(order) - start[group]
    across = np.ceil(np.sqrt((count + 1) // 2)).astype(np.int64)[group]
    square, upper = np.divmod(rank, 2)
    row, column = np.divmod(square, across)
    halves = np.array([[(0, 0), (1, 0), (0, 1)], [(1, 1), (0, 1), (1, 0)]], np.float64)
    return (halves[upper] + np.stack([column, row], 1)[:, None]) / across[:, None, None]


def along_curve(position: np.ndarray) -> np.ndarray:
    """Numbers of points ((n, 3) float) that are near for near points, (n,) int64: Morton's order."""
    if not len(position):
        return np.zeros(0, np.int64)
    low = position.min(0)
    place = ((position - low) / max(float(np.ptp(position, axis=0).max()), 1e-30) * 1023).astype(np.int64)
    number = np.zeros(len(place), np.int64)
    for bit in range(10):
        for axis in range(3):
            number |= (place[:, axis] >> bit & 1) << (3 * bit + axis)
    return number


def with_strip(
    mesh: Mesh, sparse: Sparse, dense: np.ndarray, edge: float, largest: int
) -> tuple[np.ndarray, int, int, Crumbs]:
    """Lay the strip over an unwrap of the other triangles.

    Parameters
    ----------
    dense : (t - k, 3, 2) float32
        The others' coordinates in [0, 1].
    edge : float
        Texels wanted along that square.
    largest : int
        Upper bound of the atlas's edge, in whole steps.

    Returns
    -------
    uv : (t, 3, 2) float32
    size : int
        The atlas's edge in texels.
    square : int
        Texels along the other triangles' square.
    crumbs : Crumbs
    """
    step = SURFACE.step
    size, coarser = min(-(-int(np.ceil(edge)) // step) * step, largest), 1.0
    while True:
        strip_uv, height, crumbs = sparse.placed(size, coarser)
        if size < largest and size - height < edge:
            size = min(size + step, largest)
        elif size >= largest and height > SPARSE.highest * size:
            coarser *= 2
        else:
            break
    square = size - height
    uv = np.zeros((len(mesh.triangles), 3, 2), np.float32)
    is_dense = np.ones(len(uv), bool)
    is_dense[sparse.triangle] = False
    uv[is_dense] = dense * (square / size)
    uv[sparse.triangle] = (strip_uv + (0, square)) / size
    return uv, size, square, crumbs._replace(corner=crumbs.corner + (0, square))
