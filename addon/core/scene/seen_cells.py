"""Where on the surface the frames look, and the coarse cells that stand for the rest.

Light that no frame saw still counts, but texels there show nothing that was measured: one element stands for a whole
cell of them. So it does on what belongs to another part of a building (`Mesh.far`), in larger cells.
"""

from collections.abc import Sequence

import numpy as np

from ..kinds import Block
from ..parallel import blocks, ordered_map
from .model import Camera, Mesh
from .params import SPARSE
from .rays import RayScene
from .sparse_hits import pixel_edges, sparse_hits

ROWS: Block[int] = 1 << 18
_STEPS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x27D4EB2F165667C5, 0x94D049BB133111EB],
                  np.uint64)  # fmt: skip
_AROUND = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), -1).reshape(-1, 3)


class SeenCells:
    """Cells of space in which the frames see one object from one side.

    Parameters
    ----------
    mesh : Mesh
        Its normals face the frames.
    scene : RayScene
        Of that mesh.
    cameras : sequence of Camera
        At least one.
    texel : float
        Edge of an element in metres.

    Attributes
    ----------
    met : (t,) bool
        Triangles that rays of the frames met closely.
    coarser : (t,) float64
        How many times as wide as others the coarse cells on each triangle are.
    """

    def __init__(self, mesh: Mesh, scene: RayScene, cameras: Sequence[Camera], texel: float, threads: int = 0):
        self._edge = SPARSE.cell * texel
        self._label, area = sides(mesh), mesh.geometry[1]
        centres = np.array([camera.centre for camera in cameras])
        self._low, self._high = centres.min(0), centres.max(0)
        far = np.zeros(len(mesh.triangles), bool) if mesh.far is None else mesh.far
        self.coarser = np.where(far, SPARSE.far / SPARSE.coarse, 1.0)
        large = np.sqrt(area) > SPARSE.large * texel

        def look(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            """Triangles and cells that a camera's rays meet closely, and its pairs of large triangles and cells."""
            pixels, directions, hits = sparse_hits(scene, camera)
            # What fills a pixel with a whole cell is resolved no better than what no frame saw.
            near = np.flatnonzero((pixel_edges(camera, pixels, hits) <= self._edge) & ~far[hits.triangle])
            triangle = hits.triangle[near]
            position = camera.centre + hits.distance[near, None] * directions[near]
            key = self._key(position, triangle, 0)
            on_large = large[triangle]
            pairs = np.unique(np.stack([triangle[on_large].astype(np.uint64), key[on_large]], 1), axis=0)
            return np.unique(triangle), np.unique(key), pairs

        triangles, keys, pairs = zip(*ordered_map(look, cameras, threads), strict=True)
        self.met = np.zeros(len(mesh.triangles), bool)
        self.met[np.concatenate(triangles)] = True
        cells = np.unique(np.concatenate(keys))
        # A cell's number is linear in its place, so the cells around it lie at fixed distances.
        self._cells = np.unique(cells[:, None] + _numbers(_AROUND)) if len(cells) else cells
        pairs = np.unique(np.concatenate(pairs), axis=0)
        self._count = np.bincount(pairs[:, 0].astype(np.int64), minlength=len(mesh.triangles))

    def _key(self, position: np.ndarray, triangle: np.ndarray, level: np.ndarray | int) -> np.ndarray:
        """Number of the cell at points of triangles, (n,) uint64; cells of a level are twice those of the last."""
        edge = self._edge * np.exp2(level)
        place = np.floor(position / (edge[:, None] if np.ndim(edge) else edge)).astype(np.int64)
        return cell_numbers(place, self._label[triangle], level)

    def seen(self, position: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Whether points ((n, 3) float, of triangles (n,) int) lie where the frames look, (n,) bool."""
        seen = np.zeros(len(position), bool)
        if len(self._cells):
            for part in blocks(len(position), ROWS):
                key = self._key(position[part], triangle[part], 0)
                index = np.minimum(np.searchsorted(self._cells, key), len(self._cells) - 1)
                seen[part] = self._cells[index] == key
        return seen

    def area_met(self, triangle: np.ndarray) -> np.ndarray:
        """Surface of large triangles ((n,) int) that rays met, to a cell, (n,) float64, square metres."""
        return np.maximum(self._count[triangle], 1) * self._edge**2

    def coarse_edge(self, position: np.ndarray, coarser: np.ndarray | float = 1.0) -> np.ndarray:
        """Edge of the coarse cell around points ((n, 3) float), (n,) float64, metres."""
        distance = np.maximum(np.maximum(self._low - position, position - self._high), 0)
        by_distance = SPARSE.angle * np.sqrt(np.einsum("ij,ij->i", distance, distance)) / self._edge
        # Steps of two: cells of neighbouring places are mostly of one size.
        return self._edge * np.exp2(
            np.ceil(np.log2(coarser * np.maximum(by_distance, SPARSE.coarse / SPARSE.cell)) - 1e-9)
        )

    def coarse(self, position: np.ndarray, triangle: np.ndarray, coarser: np.ndarray | float = 1.0) -> np.ndarray:
        """Number of the coarse cell of each point ((n, 3) float, of triangles (n,) int), (n,) uint64.

        Cells are `coarser` ((n,) float, or one for all) times as wide as usual there.
        """
        wider = coarser * self.coarser[triangle]
        number = np.empty(len(position), np.uint64)
        for part in blocks(len(position), ROWS):
            edge = self.coarse_edge(position[part], wider[part])
            number[part] = self._key(
                position[part], triangle[part], np.log2(edge / self._edge).round().astype(np.int64)
            )
        return number


def sides(mesh: Mesh) -> np.ndarray:
    """A number for each triangle's object and the side that it faces, alike where both are, (t,) int64."""
    normal, _ = mesh.geometry
    side = 2 * np.abs(normal).argmax(1)
    side += np.take_along_axis(normal, (side // 2)[:, None], 1)[:, 0] > 0
    label = (mesh.object_id.astype(np.int64) * 6 + side) * 2
    if mesh.backs is not None:
        label[len(mesh.triangles) - len(mesh.backs) :] += 1
    return label


def cell_numbers(place: np.ndarray, label: np.ndarray, level: np.ndarray | int) -> np.ndarray:
    """A number for each cell's place ((n, 3) int), label and size ((n,) int), (n,) uint64: almost surely its own."""
    with np.errstate(over="ignore"):
        number = _numbers(place) + label.astype(np.uint64) * _STEPS[3]
        return number + np.asarray(level).astype(np.uint64) * _STEPS[4]


def _numbers(place: np.ndarray) -> np.ndarray:
    """A number for each place ((n, 3) int) on a grid, (n,) uint64: almost surely different for any two."""
    with np.errstate(over="ignore"):
        return (place.astype(np.uint64) * _STEPS[:3]).sum(1, dtype=np.uint64)
