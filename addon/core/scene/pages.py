"""The atlas in parts: an image for each object, or UDIM tiles, made of the room atlas's own islands.

Islands are moved by whole texels, so an image in parts shows the very texels of the room's; those of an object that
the frames resolve finer are enlarged. All parts lie side by side in one square, the sheet, on which finer detail is
computed as on any atlas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from .params import SPARSE, SURFACE
from .uv_islands import boxes, connected, corner_ids

OBJECT, UDIM = "object", "udim"


@dataclass(frozen=True)
class Page:
    """One image: `number` is an object's id, or a tile's (1001...); a rectangle of the sheet, in texels."""

    number: int
    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True)
class Pages:
    """How a room's atlas is parted.

    Attributes
    ----------
    uv : (t, 3, 2) float32
        Coordinates for the images: in [0, 1] of the object's own, or tile by tile as UDIM has it.
    sheet_uv : (t, 3, 2) float32
        The same corners on the sheet, in [0, 1].
    size : int
        Edge of the sheet in texels.
    scale : dict of int to float
        By object: texels of the sheet along one of the room's.
    island : (i, 6) float64
        Of each island: lower left of its box on the room's atlas, on the sheet, and width and height there, in texels.
    island_object : (i,) int64
    """

    pages: tuple[Page, ...]
    uv: np.ndarray
    sheet_uv: np.ndarray
    size: int
    scale: dict[int, float]
    island: np.ndarray
    island_object: np.ndarray

    def image(self, room: np.ndarray, owner: np.ndarray | None = None) -> np.ndarray:
        """The sheet, (size, size, c) float32, of what an image over the room's atlas, (s, s, c), shows; rows upwards.

        Between its islands a page shows its mean: smaller copies of it then have no dark seams. `owner`, if given, is
        the object that each texel of the room's shows, (s, s) int: on the room's atlas islands of two objects may lie
        within one box, and a part shows nothing of another's.
        """
        sheet = np.zeros((self.size, self.size, room.shape[2]), np.float32)
        empty = np.ones(sheet.shape[:2], bool)
        for (x0, y0, x, y, width, height), number in zip(self.island, self.island_object, strict=True):
            x, y, width, height = int(x), int(y), int(width), int(height)
            scale = self.scale[int(number)]
            columns, rows = (_weights(start, count, scale, len(room)) for start, count in ((x0, width), (y0, height)))
            bottom, left = rows[0][0], columns[0][0]
            box = slice(bottom, rows[1][-1] + 1), slice(left, columns[1][-1] + 1)
            texels = room[box]
            foreign = np.zeros(texels.shape[:2], bool) if owner is None else owner[box] != number
            if owner is not None and foreign.all() and (owner == number).any():
                # Too narrow for a texel of its own: what the object shows elsewhere.
                texels = np.broadcast_to(room[owner == number].mean(0), texels.shape)
            elif foreign.any() and not foreign.all():
                texels = texels[tuple(distance_transform_edt(foreign, return_distances=False, return_indices=True))]
            rows, columns = (
                (low - start, high - start, share) for (low, high, share), start in ((rows, bottom), (columns, left))
            )
            content = texels[rows[0][:, None], columns[0]] if scale == 1 else _between(texels, rows, columns)
            sheet[y : y + height, x : x + width] = content
            empty[y : y + height, x : x + width] = False
        for page in self.pages:
            content, gaps = self.of(sheet, page), self.of(empty, page)
            content[gaps] = content[~gaps].mean(0)
        return sheet

    def multiply(self, sheet: np.ndarray, other: Pages, factor: np.ndarray) -> None:
        """Multiply a sheet's islands of the objects that another layout of the same atlas has by what its sheet holds.

        The other has them at the same scale, so texel meets texel.
        """
        island = self.island[np.isin(self.island_object, other.island_object)].astype(np.int64)
        other_island = other.island.astype(np.int64)
        if len(island) != len(other_island) or (island[:, [0, 1, 4, 5]] != other_island[:, [0, 1, 4, 5]]).any():
            raise ValueError("the other layout is not of the same atlas at the same scale")
        for (x, y, width, height), (x0, y0) in zip(island[:, 2:].tolist(), other_island[:, 2:4].tolist(), strict=True):
            sheet[y : y + height, x : x + width] *= factor[y0 : y0 + height, x0 : x0 + width]

    def of(self, sheet: np.ndarray, page: Page) -> np.ndarray:
        """A page's part of an image of the sheet."""
        return sheet[page.y : page.y + page.height, page.x : page.x + page.width]


def _weights(start: float, count: int, scale: float, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For `count` texels from `start` on: the room's texels to both sides, and how near each lies to the second."""
    coordinate = start + (np.arange(count) + 0.5) / scale - 0.5
    low = np.floor(coordinate + 1e-6).astype(np.int64)
    share = np.clip(coordinate - low, 0, 1).astype(np.float32)
    return np.clip(low, 0, size - 1), np.clip(low + 1, 0, size - 1), share


def _between(room, rows, columns):
    (y0, y1, b), (x0, x1, a) = rows, columns
    a, b = a[None, :, None], b[:, None, None]
    low = room[y0[:, None], x0] * (1 - a) + room[y0[:, None], x1] * a
    high = room[y1[:, None], x0] * (1 - a) + room[y1[:, None], x1] * a
    return low * (1 - b) + high * b


def lay_out(
    kind: str,
    triangles: np.ndarray,
    uv: np.ndarray,
    object_id: np.ndarray,
    size: int,
    scale: dict[int, float],
    largest: int,
) -> Pages:
    """Part a room's atlas.

    Parameters
    ----------
    kind : str
        `OBJECT` or `UDIM`.
    triangles : (t, 3) int
    uv : (t, 3, 2) float32
        On the room's atlas.
    object_id : (t,) int
    size : int
        Edge of that atlas in texels.
    scale : dict of int to float
        By object: how much larger its islands become; 1 where left out. Lowered where its image would not fit.
    largest : int
        Upper bound of an image's edge in texels.
    """
    island = _by_block(connected(corner_ids(triangles, uv), object_id), uv * (size / SPARSE.block), object_id)
    first = np.unique(island, return_index=True)[1]
    owner = object_id[first].astype(np.int64)
    low, high = (edge.astype(np.float64) * size for edge in boxes(uv, island))
    corner = np.floor(low) - SURFACE.margin // 2
    extent = np.ceil(high) + SURFACE.margin // 2 - corner
    numbers = np.unique(owner).tolist()
    scale = {number: float(scale.get(number, 1.0)) for number in numbers}
    blocks, place, box = {}, np.zeros((len(first), 2)), np.zeros((len(first), 2))
    for number in numbers:
        members = np.flatnonzero(owner == number)
        while True:
            box[members] = np.ceil(extent[members] * scale[number])
            place[members], width, height = _block(box[members], largest)
            if width <= largest and (height <= largest or kind == UDIM and box[members].max() <= largest):
                break
            scale[number] *= 0.95
        blocks[number] = members, width, height
    if kind == OBJECT:
        page, tile, offset = _in_blocks(blocks, place)
    else:
        page, tile, offset = _in_few_tiles(blocks, place, box, largest)
    origin, extents = (
        np.array([(item.x, item.y, item.width, item.height) for item in page]).reshape(-1, 2, 2).swapaxes(0, 1)
    )
    sheet = -(-int((origin + extents).max()) // SURFACE.step) * SURFACE.step
    place += origin[tile] + offset
    factor = np.array([scale[int(number)] for number in owner])
    on_sheet = (uv * size - corner[island][:, None]) * factor[island][:, None, None] + place[island][:, None]
    of_page = tile[island]
    own_uv = (on_sheet - origin[of_page][:, None]) / extents[of_page][:, None]
    if kind == UDIM:
        number = np.array([item.number - 1001 for item in page])[of_page]
        own_uv += np.stack([number % 10, number // 10], -1)[:, None]
    return Pages(
        tuple(page),
        own_uv.astype(np.float32),
        (on_sheet / sheet).astype(np.float32),
        sheet,
        scale,
        np.concatenate([corner, place, box], 1),
        owner,
    )


def _by_block(island: np.ndarray, block_uv: np.ndarray, object_id: np.ndarray) -> np.ndarray:
    """Islands ((t,) int), those of an object in one block (of edge 1 in `block_uv`, (t, 3, 2)) made one."""
    low, high = (np.floor(edge) for edge in boxes(block_uv, island))
    within = (low == high).all(1)
    first = np.unique(island, return_index=True)[1]
    place = np.concatenate([low, object_id[first, None]], 1)
    place[~within] = np.stack([-1 - np.arange(len(first))] * 3, 1)[~within]
    return np.unique(place, axis=0, return_inverse=True)[1].reshape(-1)[island]


def shelves(box: np.ndarray, width: int) -> tuple[np.ndarray, int, int]:
    """Rectangles ((n, 2) width and height) in rows of at most `width`: lower left corners, and what they take."""
    place = np.zeros_like(box)
    x = y = height = widest = 0
    for k in np.lexsort((-box[:, 0], -box[:, 1])).tolist():
        w, h = int(box[k, 0]), int(box[k, 1])
        if x and x + w > width:
            x, y, height = 0, y + height, 0
        place[k] = x, y
        x, height = x + w, max(height, h)
        widest = max(widest, x)
    return place, widest, y + height


def _block(box: np.ndarray, largest: int) -> tuple[np.ndarray, int, int]:
    """The rectangles in a block that is nearly square and small: lower left corners, width and height."""
    side = np.sqrt(box.prod(1).sum())
    widths = {
        int(np.clip(np.ceil(side * shape), box[:, 0].max(), max(largest, box[:, 0].max())))
        for shape in SURFACE.page_shapes
    }
    layouts = [shelves(box, width) for width in sorted(widths)]
    return min(layouts, key=lambda layout: (max(layout[1:]) > largest, layout[1] * layout[2]))


def _in_blocks(blocks, place):
    """A page for each object, side by side."""
    extents = np.array([(width, height) for _, width, height in blocks.values()], np.float64)
    corner, _, _ = shelves(extents, int(max(np.sqrt(extents.prod(1).sum()) * 1.1, extents[:, 0].max())))
    pages, tile = [], np.zeros(len(place), np.int64)
    for k, (number, (members, width, height)) in enumerate(blocks.items()):
        pages.append(Page(int(number), int(corner[k, 0]), int(corner[k, 1]), int(width), int(height)))
        tile[members] = k
    return pages, tile, np.zeros_like(place)


def _in_few_tiles(blocks, place, box, largest):
    """One tile that is no larger than it has to be, else several of the largest."""
    needed = max(max(width, height) for _, width, height in blocks.values())
    total = sum(width * height for _, width, height in blocks.values())
    edge = -(-int(max(needed, np.sqrt(total))) // SURFACE.step) * SURFACE.step
    while edge < largest:
        layout = _in_tiles(blocks, place.copy(), box, edge)
        if len(layout[0]) == 1:
            return layout
        edge += SURFACE.step
    return _in_tiles(blocks, place, box, largest)


def _in_tiles(blocks, place, box, largest):
    """Tiles of one edge, no object on two of them but one that is larger than a tile."""
    parts = []
    for members, width, height in sorted(blocks.values(), key=lambda block: -block[2]):
        if height <= largest:
            parts.append((members, width, height))
            continue
        # Row by row: what begins in a tile's height ends in the next.
        remaining = members[np.argsort(place[members, 1], kind="stable")]
        while len(remaining):
            base = place[remaining, 1].min()
            fits = place[remaining, 1] + box[remaining, 1] <= base + largest
            rows = np.unique(place[remaining[~fits], 1])
            placed = remaining[fits & ~np.isin(place[remaining, 1], rows)] if len(rows) else remaining
            place[placed, 1] -= base
            parts.append((placed, width, int((place[placed, 1] + box[placed, 1]).max())))
            remaining = np.setdiff1d(remaining, placed)
    shelves: list[list[int]] = []  # tile, x that is free, y, height
    full: list[int] = []  # height of each tile that is taken
    offset, tile = np.zeros_like(place), np.zeros(len(place), np.int64)
    for members, width, height in sorted(parts, key=lambda part: -part[2]):
        shelf = next((shelf for shelf in shelves if shelf[1] + width <= largest and height <= shelf[3]), None)
        if shelf is None:
            tile_index = next((k for k, used_height in enumerate(full) if used_height + height <= largest), None)
            if tile_index is None:
                tile_index = len(full)
                full.append(0)
            shelf = [tile_index, 0, full[tile_index], height]
            shelves.append(shelf)
            full[tile_index] += height
        tile[members], offset[members] = shelf[0], (shelf[1], shelf[2])
        shelf[1] += width
    across = int(np.ceil(np.sqrt(len(full))))
    pages = [Page(1001 + k, k % across * largest, k // across * largest, largest, largest) for k in range(len(full))]
    return pages, tile, offset
