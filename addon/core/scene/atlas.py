"""The texel atlas: one image over the whole room, and the surface elements that its texels stand for."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..groups import by_number
from ..significance import LEVELS
from .params import SPARSE, SURFACE


@dataclass(frozen=True)
class Atlas:
    """The atlas and its n surface elements.

    Images are (size, size, ...) arrays whose row 0 is the bottom (v = 0), as in Blender; files are written top-down.

    Attributes
    ----------
    size : int
        Edge of the square image in texels.
    uv : (t, 3, 2) float32
        Atlas coordinates in [0, 1] of each triangle's corners; no two triangles overlap.
    texel : (n,) int32
        Flat index (row * size + column) of each element.
    triangle : (n,) int32
    position : (n, 3) float32
        World, metres.
    normal : (n, 3) float32
        Unit, the triangle's geometric normal.
    object_id : (n,) int32
    area : (n,) float32
        Surface that the element stands for, square metres.
    padding : (size * size,) int32
        The element whose value a texel shows: its own, or the nearest one of the same object within the padding;
        -1 for empty texels.
    back : (n,) bool or None
        On the second side of a sheet (`Mesh.backs`); None where there is no such sheet.
    """

    size: int
    uv: np.ndarray
    texel: np.ndarray
    triangle: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    object_id: np.ndarray
    area: np.ndarray
    padding: np.ndarray
    back: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.texel)

    @cached_property
    def texel_edge(self) -> float:
        """Edge of a typical element, metres."""
        return float(np.sqrt(np.median(self.area)))

    @property
    def weight(self) -> np.ndarray:
        """Surface that an element counts for in a mean over the room, (n,) float32: no more than a quarter of a cell
        near the cameras, however large the ground that it stands for."""
        return np.minimum(self.area, np.float32((SPARSE.cell / 2 * self.texel_edge) ** 2))

    @property
    def side(self) -> np.ndarray:
        """Twice the object's number, plus 1 on the second side of a sheet, (n,) int64."""
        return 2 * self.object_id.astype(np.int64) + (0 if self.back is None else self.back)

    @cached_property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the room, (3,) each: `room_box` of the elements."""
        return room_box(self.position)

    @cached_property
    def _elements_of(self) -> dict[int, np.ndarray]:
        return by_number(self.object_id)

    def elements_of(self, object_id: int) -> np.ndarray:
        """Indices of an object's elements, (k,) int, rising."""
        return self._elements_of.get(object_id, np.zeros(0, np.int64))

    def place(self, index: np.ndarray) -> np.ndarray:
        """Elements (m,) as points (m, 6) whose nearest neighbours lie close and face the same way."""
        return np.concatenate([self.position[index], SURFACE.turned * self.normal[index]], 1)

    def image(self, values: np.ndarray, empty: float = 0.0) -> np.ndarray:
        """Spread values of the elements ((n,) or (n, c)) over the image, islands padded: (size, size[, c])."""
        flat = np.empty((self.size * self.size, *values.shape[1:]), values.dtype)
        # Into place: what indexing makes for a moment is as large as a large room's image.
        np.take(values, self.padding, 0, out=flat, mode="clip")
        flat[self.padding < 0] = empty
        return flat.reshape(self.size, self.size, *values.shape[1:])


def room_box(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner ((3,) each) of the box around points ((n, 3) float).

    Where few lie far off all others it ends where all but a few do: more than half of what the middle ones span lies
    between.
    """
    low, high = position.min(0), position.max(0)
    outer, outliers = SPARSE.outer, 1 - LEVELS.nearly_all
    start, first, last, end = np.quantile(position, (outliers, outer, 1 - outer, 1 - outliers), axis=0)
    lower, upper = first - (last - first) / 2, last + (last - first) / 2
    return np.where(low < lower, np.maximum(start, lower), low), np.where(high > upper, np.minimum(end, upper), high)
