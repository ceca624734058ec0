"""The surface stage: normals towards the cameras, the atlas's resolution, the surface elements."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import BadInputError
from .atlas import Atlas
from .element_groups import ElementGroups
from .elements import Crumbs, ElementLookup, Elements, find_elements, make_atlas, shown_uv, uv_scale
from .model import Camera, Mesh
from .orientation import seen_sides
from .params import SURFACE
from .rays import RayScene
from .seen_cells import SeenCells
from .sparse_layout import Sparse, with_strip
from .two_sides import with_backs
from .unwrap import takes_parts


@dataclass(frozen=True)
class Surface:
    """The room's surface, ready for the stages.

    Attributes
    ----------
    mesh : Mesh
        The capture's, with windings turned so that normals face the cameras; then the second sides of the sheets that
        these see both sides of (`Mesh.backs`).
    sign : (s,) number
        Of each of the capture's triangles: negative where its winding was turned.
    texel_size : float
        Edge of a surface element in metres.
    noise : float
        What was taken out of the capture's vertices: standard deviation along the normals, in metres.
    """

    mesh: Mesh
    atlas: Atlas
    scene: RayScene
    sign: np.ndarray
    texel_size: float
    noise: float = 0.0

    @property
    def uv(self) -> np.ndarray:
        """Atlas coordinates in the corner order of the capture's own mesh; then those of the second sides, turned
        alike: (t, 3, 2) float32."""
        return turned(self.atlas.uv, _with_back_signs(self.mesh, self.sign))

    @cached_property
    def shown_uv(self) -> np.ndarray:
        """Atlas coordinates for a renderer: `elements.shown_uv`."""
        return shown_uv(self.mesh, self.atlas)

    @property
    def first_uv(self) -> np.ndarray:
        """`shown_uv` of the capture's own triangles, in their corner order. Where a mesh must stay as it is, its sheets
        show the side seen more."""
        return turned(self.shown_uv[: len(self.sign)], self.sign)

    @cached_property
    def lookup(self) -> ElementLookup:
        """The element at any point."""
        return ElementLookup(self.mesh, self.atlas)

    @cached_property
    def groups(self) -> ElementGroups:
        """The elements in groups, and which of them frames were found to see."""
        return ElementGroups(self.atlas)

    @property
    def backs(self) -> np.ndarray:
        """The triangles that have a second side, (s,) int32."""
        return np.zeros(0, np.int32) if self.mesh.backs is None else self.mesh.backs


def turned(corners: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Per-corner data ((t, 3, ...)) with the winding turned where `sign` is negative."""
    result = corners.copy()
    result[sign < 0] = corners[sign < 0][:, [0, 2, 1]]
    return result


def without_triangles(mesh: Mesh, removed: np.ndarray) -> Mesh:
    """What an unwrap needs of a mesh's other triangles; second sides count as any."""
    remaining = np.ones(len(mesh.triangles), bool)
    remaining[removed] = False
    uv = None if mesh.uv is None else mesh.uv[remaining]
    return Mesh(mesh.vertices, mesh.triangles[remaining], mesh.object_id[remaining], uv=uv)


def _with_back_signs(mesh: Mesh, sign: np.ndarray) -> np.ndarray:
    """The signs of a mesh's first sides, and the same for its second ones."""
    return sign if mesh.backs is None else np.concatenate([sign, sign[mesh.backs]])


def facing(mesh: Mesh, sign: np.ndarray) -> Mesh:
    """The mesh with its windings turned where `sign` is negative, second sides ((s,) `Mesh.backs`) like their first;
    without texture coordinates of its own."""
    return replace(mesh, triangles=turned(mesh.triangles, _with_back_signs(mesh, sign)), uv=None)


def atlas_size(area: float, texel: float, largest: int) -> int:
    """Edge of an atlas whose texels measure `texel` metres on `area` square metres, within bounds."""
    return _whole_steps(np.sqrt(area / SURFACE.expected_fill) / max(texel, 1e-12), largest)


def _whole_steps(edge: float, largest: int) -> int:
    """An atlas' edge of at least so many texels, if that is not above `largest`."""
    step = SURFACE.step
    return int(np.clip(np.ceil(edge / step) * step, step, largest // step * step))


def build_surface(
    mesh: Mesh,
    cameras: Sequence[Camera],
    unwrap: Callable[[Mesh, int], np.ndarray],
    texel_size: float = 0.0,
    detail: float = 1.0,
    largest: int = 4096,
    two_sides: bool = True,
    coarse_unseen: bool = True,
    threads: int = 0,
) -> Surface:
    """Lay out the surface elements.

    Parameters
    ----------
    unwrap : callable
        Gives atlas coordinates ((t, 3, 2) float32 in [0, 1], no overlap) for a mesh and an atlas size in texels.
    cameras : sequence of Camera
        None: normals stay as the mesh has them, and `texel_size` has to be given.
    texel_size : float
        Edge of an element in metres; 0 takes it from the frames' footprint.
    detail : float
        Texels along one pixel of that footprint.
    largest : int
        Upper bound of the atlas's edge.
    two_sides : bool
        Give triangles that are seen from both sides a second side of its own.
    coarse_unseen : bool
        Let one element stand for many texels where no camera looks.

    Raises
    ------
    BadInputError
        No camera looks at the mesh.
    """
    sides = seen_sides(mesh, cameras)
    if sides.footprint <= 0 and (cameras or not texel_size):
        raise BadInputError(
            "No camera of the capture looks at the mesh; check that transforms.json and mesh.ply share one frame."
        )
    mesh = with_backs(mesh, np.flatnonzero(sides.both & two_sides))
    towards = facing(mesh, sides.sign)
    scene = RayScene(towards.vertices, towards.triangles, towards.backs)
    texel = texel_size or sides.footprint / detail
    cells = SeenCells(towards, scene, cameras, texel, threads) if cameras and coarse_unseen else None
    uv, size, edge, crumbs = _laid_out(mesh, unwrap, texel, largest, cells)
    elements = find_elements(towards, turned(uv, _with_back_signs(mesh, sides.sign)), size, cells, crumbs, threads)
    return from_uv(mesh, sides.sign, uv, size, edge, elements, scene=scene)


def _laid_out(
    mesh: Mesh, unwrap: Callable[[Mesh, int], np.ndarray], texel: float, largest: int, cells: SeenCells | None
) -> tuple[np.ndarray, int, float, Crumbs | None]:
    """Atlas coordinates, the atlas's edge in texels, edge of a texel in metres, and what shares texels."""
    sparse = Sparse(mesh, cells, texel) if cells is not None and takes_parts(unwrap) else None
    dense = mesh if sparse is None or not len(sparse.triangle) else without_triangles(mesh, sparse.triangle)
    _, area = dense.geometry
    uv = unwrap(dense, atlas_size(float(area.sum()), texel, largest))
    # The islands' true scale sets the size that makes a texel as large as wished.
    scale = max(uv_scale(dense, uv), 1e-12)
    edge = 1 / max(texel * scale, 1e-12)
    if sparse is not None and dense is not mesh:
        uv, size, square, crumbs = with_strip(mesh, sparse, uv, edge, _whole_steps(largest, largest))
        return uv, size, 1 / (scale * square), crumbs
    size = _whole_steps(edge, largest)
    return uv, size, 1 / (scale * size), None


def from_uv(
    mesh: Mesh,
    sign: np.ndarray,
    uv: np.ndarray,
    size: int,
    texel_size: float,
    known: Elements,
    noise: float = 0.0,
    scene: RayScene | None = None,
) -> Surface:
    """The surface for a known layout of a mesh `with_backs`, and the sign of each of its first sides.

    `known` is what was found of the elements before; so is `scene`, if given, of the rays against the mesh.
    """
    towards = facing(mesh, sign)
    atlas = make_atlas(towards, turned(uv, _with_back_signs(mesh, sign)), size, known)
    scene = scene or RayScene(towards.vertices, towards.triangles, towards.backs)
    low, high = atlas.box
    scene.fit(float(np.linalg.norm(high - low)))
    return Surface(towards, atlas, scene, sign.astype(np.int8), texel_size, noise)
