"""Sheets of which the frames see both sides: each triangle of theirs becomes two, one for either side.

A lamp shade, a curtain or a sheet of paper is often one layer of triangles. Its two sides have light and colour of
their own, so they need elements of their own. The second triangle is the first one turned over, in the same place: rays
are traced against the first alone and credited to the side that they come from (`rays.RayScene`), so that no gap
between the two has to be larger than some other distance. Renderers need one: `laid_apart`.
"""

from dataclasses import replace

import numpy as np

from ..significance import LEVELS
from .model import Mesh
from .params import SIDES
from .uv_islands import components
from .weld import point_normals, welded


def other_way(corners: np.ndarray) -> np.ndarray:
    """Per-corner data ((t, 3, ...)) with the winding turned."""
    return corners[:, [0, 2, 1]]


def two_sided(mesh: Mesh, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the sheets that are seen from both sides.

    A sheet is what hangs together within an object, has a border, and has two sides at all. It is told as a whole:
    of a shade, each triangle alone may be seen from one side only, these from within and those from without.

    Parameters
    ----------
    rays : (2, t) int
        How many rays of the frames met the front, by the winding, and the back of each triangle.

    Returns
    -------
    both : (t,) bool
    sign : (t,) float32
        There +1 or -1, so that the windings turned by it agree all over the sheet and show the side that is seen more.
    """
    count = len(mesh.triangles)
    points, faces, _ = welded(mesh)
    corner = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    owner = np.tile(np.arange(count), 3)
    low, high = np.sort(corner, 1).T
    name = (mesh.object_id[owner].astype(np.int64) * len(points) + low) * len(points) + high
    order = np.argsort(name, kind="stable")
    begin = np.flatnonzero(np.r_[True, np.diff(name[order]) != 0])
    met = np.diff(np.r_[begin, len(order)])
    border = np.zeros(count, bool)
    border[owner[order[begin[met == 1]]]] = True
    one, two = order[begin[met == 2]], order[begin[met == 2] + 1]
    # Either way round of each triangle is a node; neighbours run along their common edge in opposite directions.
    alike = (corner[one, 0] != corner[two, 0]).astype(np.int64)
    one, two = owner[one], owner[two]
    part = components(np.r_[one, one + count], np.r_[two + count * (1 - alike), two + count * alike], 2 * count)
    up, down = part[:count], part[count:]
    sheet = np.minimum(up, down)
    ways = np.where(up == sheet, 1, -1)
    front = np.bincount(sheet, np.where(ways > 0, rays[0], rays[1]), 2 * count)
    back = np.bincount(sheet, np.where(ways > 0, rays[1], rays[0]), 2 * count)
    bordered = np.bincount(sheet, border, 2 * count) > 0
    one_surface = np.ones(2 * count, bool)
    one_surface[sheet[up == down]] = False  # such as Moebius' strip
    less, rays_on = np.minimum(front, back), front + back
    seen = less >= np.maximum(SIDES.least_share * rays_on, SIDES.least_rays)
    seen |= less >= np.maximum(SIDES.least_share / 2 * rays_on, LEVELS.few)
    both = (seen & bordered & one_surface)[sheet]
    return both, np.where(front >= back, 1, -1)[sheet] * ways.astype(np.float32)


def worth_it(mesh: Mesh, both: np.ndarray) -> np.ndarray:
    """Those of the triangles `both` that are a substantial part of their object or of the room, (t,) bool."""
    _, area = mesh.geometry
    count = int(mesh.object_id.max()) + 1
    own, sheets = (np.bincount(mesh.object_id, weight, count) for weight in (area, area * both))
    large = (sheets >= SIDES.least_of_object * own) | (sheets >= SIDES.least_of_room * area.sum())
    return both & large[mesh.object_id]


def with_backs(mesh: Mesh, which: np.ndarray) -> Mesh:
    """The mesh with a second side for some of its triangles; itself for none.

    Parameters
    ----------
    which : (s,) int
        Sorted.

    Returns
    -------
    Mesh
        Its last s triangles are those of `which` turned over, on vertices of their own in the same places.
    """
    if not len(which):
        return mesh
    used, corners = np.unique(mesh.triangles[which], return_inverse=True)
    backs = other_way(corners.reshape(-1, 3) + len(mesh.vertices)).astype(mesh.triangles.dtype)
    return replace(
        mesh,
        vertices=np.concatenate([mesh.vertices, mesh.vertices[used]]),
        triangles=np.concatenate([mesh.triangles, backs]),
        object_id=np.concatenate([mesh.object_id, mesh.object_id[which]]),
        uv=None if mesh.uv is None else np.concatenate([mesh.uv, other_way(mesh.uv[which])]),
        backs=np.asarray(which, np.int32),
    )


def fronts(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
    """The mesh without second sides, and the triangle of it that each of the t triangles lies in, (t,) int."""
    if mesh.backs is None:
        return mesh, np.arange(len(mesh.triangles))
    count = len(mesh.triangles) - len(mesh.backs)
    uv = None if mesh.uv is None else mesh.uv[:count]
    single = replace(mesh, triangles=mesh.triangles[:count], object_id=mesh.object_id[:count], uv=uv, backs=None)
    return single, np.r_[np.arange(count), mesh.backs]


def laid_apart(mesh: Mesh, vertices: np.ndarray) -> Mesh:
    """The mesh with a gap between its sheets' two sides, as a renderer needs it.

    Parameters
    ----------
    mesh : Mesh
        See `with_backs`.
    vertices : (v, 3) float64
        Where the vertices of its first sides are wanted.

    Returns
    -------
    Mesh
        First sides lie where they lay; each second one has three vertices of its own.
    """
    single, _ = fronts(mesh)
    if mesh.backs is None:
        return replace(mesh, vertices=vertices)
    single = replace(single, vertices=vertices, triangles=single.triangles[mesh.backs], uv=None)
    points, faces, _ = welded(single)
    corners = points[faces]
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-30)
    way = point_normals(points, faces)[faces]
    upright = (np.einsum("tkj,tj->tk", way, own) >= SIDES.upright).all(1)
    way[~upright] = own[~upright, None]
    low, high = vertices.min(0), vertices.max(0)
    # Far from the origin float32, which renderers work in, is coarser than that.
    coarse = float(np.spacing(np.float32(np.abs([low, high]).max())))
    gap = max(SIDES.gap * float(np.linalg.norm(high - low)), 8 * coarse)
    count = len(mesh.triangles) - len(mesh.backs)
    backs = np.arange(len(vertices), len(vertices) + 3 * len(mesh.backs)).reshape(-1, 3)
    return replace(
        mesh,
        vertices=np.concatenate([vertices, other_way(corners - gap * way).reshape(-1, 3)]),
        triangles=np.concatenate([mesh.triangles[:count], backs]).astype(mesh.triangles.dtype),
    )
