"""Surface elements: the atlas's texels with their place on the surface."""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from ..kinds import Block
from .atlas import Atlas
from .model import Mesh
from .rays import RayScene

# Where in a texel it is asked which triangle covers it: the centre first, so that a texel which only touches a
# triangle still gets an element at its border, and thin triangles are not lost.
SUBSAMPLES = np.array(
    [[0, 0], [-0.25, -0.25], [0.25, 0.25], [-0.25, 0.25], [0.25, -0.25],
     [-0.45, -0.45], [0.45, 0.45], [-0.45, 0.45], [0.45, -0.45], [0, 0.45], [0, -0.45], [0.45, 0], [-0.45, 0]],
    np.float32,
)  # fmt: skip
ROWS_AT_ONCE: Block[int] = 128


def triangle_geometry(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals ((t, 3) float32, by the winding) and areas ((t,) float64, square metres)."""
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    return (cross / np.maximum(length, 1e-300)[:, None]).astype(np.float32), length / 2


def uv_scale(mesh: Mesh, uv: np.ndarray) -> float:
    """Atlas units for one metre: root of UV area over surface area, over the whole mesh."""
    _, area = triangle_geometry(mesh)
    p = uv.astype(np.float64)
    e, f = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    uv_area = np.abs(e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]).sum() / 2
    return float(np.sqrt(uv_area / max(area.sum(), 1e-30)))


def _cover(uv: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each texel the triangle over it (-1: none) and the barycentric point, by rays against the unwrapped mesh."""
    flat = np.concatenate([uv.reshape(-1, 2).astype(np.float64) * size, np.zeros((3 * len(uv), 1))], 1)
    plane = RayScene(flat, np.arange(3 * len(uv), dtype=np.int32).reshape(-1, 3))
    triangle = np.full(size * size, -1, np.int32)
    u, v = np.zeros(size * size, np.float32), np.zeros(size * size, np.float32)

    def ask(texels: np.ndarray, shift: np.ndarray) -> None:
        origins = np.empty((len(texels), 3), np.float32)
        origins[:, 0] = texels % size + 0.5 + shift[0]
        origins[:, 1] = texels // size + 0.5 + shift[1]
        origins[:, 2] = 1.0
        down = np.broadcast_to(np.array([0, 0, -1], np.float32), origins.shape)
        hits = plane.intersect(origins, down)
        found = hits.triangle >= 0
        at = texels[found]
        triangle[at], u[at], v[at] = hits.triangle[found], hits.u[found], hits.v[found]

    for row in range(0, size, ROWS_AT_ONCE):
        texels = np.arange(row * size, min(row + ROWS_AT_ONCE, size) * size)
        ask(texels, SUBSAMPLES[0])
    # Only empty texels beside a covered one, or under a triangle too small for any centre, can be covered in part; what
    # is found so has neighbours in turn, along a sliver's whole length.
    corners = np.clip((uv.reshape(-1, 2) * size).astype(np.int64), 0, size - 1)
    near = ndimage.binary_dilation((triangle >= 0).reshape(size, size), np.ones((3, 3), bool))
    near[corners[:, 1], corners[:, 0]] = True
    unasked = triangle < 0
    wanted = np.flatnonzero(near.ravel() & unasked)
    while len(wanted):
        unasked[wanted] = False
        for shift in SUBSAMPLES[1:]:
            ask(wanted[triangle[wanted] < 0], shift)
        covered = np.divmod(wanted[triangle[wanted] >= 0], size)
        rows, columns = (np.clip(at + np.array([-1, 0, 1])[:, None], 0, size - 1) for at in covered)
        around = np.unique(rows[:, None] * size + columns[None])
        wanted = around[unasked[around]]
    return triangle, u, v


def _padding(texel: np.ndarray, size: int) -> np.ndarray:
    """The nearest element of every texel, (size * size,) int32."""
    element = np.full(size * size, -1, np.int32)
    element[texel] = np.arange(len(texel), dtype=np.int32)
    nearest = ndimage.distance_transform_edt(
        element.reshape(size, size) < 0, return_distances=False, return_indices=True
    )
    return element.reshape(size, size)[nearest[0], nearest[1]].ravel()


Covered = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Texel, triangle and position of each element: what takes time to find."""


def _covered(mesh: Mesh, uv: np.ndarray, size: int) -> Covered:
    triangle, u, v = _cover(uv, size)
    texel = np.flatnonzero(triangle >= 0)
    triangle, u, v = triangle[texel], u[texel, None].astype(np.float64), v[texel, None].astype(np.float64)
    a, b, c = (mesh.vertices[mesh.triangles[triangle, i]] for i in range(3))
    return texel, triangle, (a + u * (b - a) + v * (c - a)).astype(np.float32)


def make_atlas(mesh: Mesh, uv: np.ndarray, size: int, known: Covered | None = None) -> Atlas:
    """Surface elements at the texels that `uv` covers.

    Parameters
    ----------
    mesh : Mesh
    uv : (t, 3, 2) float32
        Atlas coordinates in [0, 1], without overlap.
    size : int
        Edge of the atlas in texels.
    known : Covered, optional
        Of the same atlas, made before.
    """
    texel, triangle, position = known or _covered(mesh, uv, size)
    normal, area = triangle_geometry(mesh)
    # Each triangle's surface is shared out between its elements; what no element covers is left out.
    count = np.bincount(triangle, minlength=len(mesh.triangles))
    return Atlas(
        size=size,
        uv=uv,
        texel=texel,
        triangle=triangle,
        position=position,
        normal=normal[triangle],
        object_id=mesh.object_id[triangle],
        area=(area[triangle] / count[triangle]).astype(np.float32),
        padding=_padding(texel, size),
        back=None if mesh.backs is None else triangle >= len(mesh.triangles) - len(mesh.backs),
    )


def element_of_triangle(mesh: Mesh, atlas: Atlas) -> np.ndarray:
    """An element for each triangle, (t,) int32: its own, else the nearest one of the same object, else the nearest."""
    first = np.full(len(mesh.triangles), -1, np.int32)
    first[atlas.triangle[::-1]] = np.arange(len(atlas) - 1, -1, -1, dtype=np.int32)
    centroid = mesh.vertices[mesh.triangles].mean(1)
    for object_id in np.unique(mesh.object_id[first < 0]):
        bare = np.flatnonzero((first < 0) & (mesh.object_id == object_id))
        own = np.flatnonzero(atlas.object_id == object_id)
        if not len(own):
            own = np.arange(len(atlas))
        first[bare] = own[cKDTree(atlas.position[own]).query(centroid[bare])[1]]
    return first


class ElementLookup:
    """The element at points on the surface, made ready for many millions of them.

    Parameters
    ----------
    mesh : Mesh
    atlas : Atlas
    """

    def __init__(self, mesh: Mesh, atlas: Atlas):
        self._atlas, self._object_id = atlas, mesh.object_id
        self._of_triangle = element_of_triangle(mesh, atlas)
        # Atlas coordinates in texels are linear in the barycentric ones: x + u dx_u + v dx_v, and y alike.
        at = atlas.uv.astype(np.float64) * atlas.size
        edges = at[:, 1:] - at[:, :1]
        self._map = np.concatenate([at[:, 0], edges.transpose(0, 2, 1).reshape(-1, 4)], 1).astype(np.float32)
        # A triangle too small for a texel of its own may show another object's: those alone are looked at closely.
        self._close = np.bincount(atlas.triangle, minlength=len(mesh.triangles)) == 0
        every = np.arange(len(mesh.triangles))
        for u, v in ((0.01, 0.01), (0.98, 0.01), (0.01, 0.98), (1 / 3, 1 / 3)):
            point = np.full((2, len(every)), ((u,), (v,)), np.float32)
            self._close |= atlas.object_id[self._texel(every, *point)] != mesh.object_id

    def _texel(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The element whose texel the points fall in."""
        size = self._atlas.size
        m = self._map[triangle]
        column = (m[:, 0] + u * m[:, 2] + v * m[:, 3]).astype(np.int32)
        row = (m[:, 1] + u * m[:, 4] + v * m[:, 5]).astype(np.int32)
        return self._atlas.padding[np.minimum(row, size - 1) * size + np.minimum(column, size - 1)]

    def __call__(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The element at each point, (n,) int32.

        Parameters
        ----------
        triangle : (n,) int32
            All >= 0.
        u, v : (n,) float32
            Barycentric coordinates of the second and third corner.
        """
        element = self._texel(triangle, u, v)
        close = np.flatnonzero(self._close[triangle])
        other = close[self._atlas.object_id[element[close]] != self._object_id[triangle[close]]]
        element[other] = self._of_triangle[triangle[other]]
        return element
