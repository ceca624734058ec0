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


def flipped(corners: np.ndarray) -> np.ndarray:
    """Per-corner data ((t, 3, ...)) with the winding turned."""
    return corners[:, [0, 2, 1]]


def two_sided(mesh: Mesh, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the sheets that are seen from both sides.

    A sheet is what is connected within an object, has a border, and has two sides at all. It is judged as a whole:
    of a shade, each triangle alone may be seen from one side only, some from within and some from without.

    Parameters
    ----------
    rays : (2, t) int
        How many rays of the frames hit the front, by the winding, and the back of each triangle.

    Returns
    -------
    both : (t,) bool
    sign : (t,) float32
        On those triangles +1 or -1, so that the windings turned by it agree all over the sheet and show
        the side that is seen more.
    """
    count = len(mesh.triangles)
    points, faces, _ = welded(mesh)
    corner = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    owner = np.tile(np.arange(count), 3)
    low, high = np.sort(corner, 1).T
    key = (mesh.object_id[owner].astype(np.int64) * len(points) + low) * len(points) + high
    order = np.argsort(key, kind="stable")
    begin = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
    face_count = np.diff(np.r_[begin, len(order)])
    border = np.zeros(count, bool)
    border[owner[order[begin[face_count == 1]]]] = True
    first, second = order[begin[face_count == 2]], order[begin[face_count == 2] + 1]
    # Either way round of each triangle is a node; neighbours run along their common edge in opposite directions.
    same_direction = (corner[first, 0] != corner[second, 0]).astype(np.int64)
    first, second = owner[first], owner[second]
    part = components(
        np.r_[first, first + count],
        np.r_[second + count * (1 - same_direction), second + count * same_direction],
        2 * count,
    )
    up, down = part[:count], part[count:]
    sheet = np.minimum(up, down)
    orientation = np.where(up == sheet, 1, -1)
    front = np.bincount(sheet, np.where(orientation > 0, rays[0], rays[1]), 2 * count)
    back = np.bincount(sheet, np.where(orientation > 0, rays[1], rays[0]), 2 * count)
    bordered = np.bincount(sheet, border, 2 * count) > 0
    one_surface = np.ones(2 * count, bool)
    one_surface[sheet[up == down]] = False  # such as Moebius' strip
    fewer_rays, all_rays = np.minimum(front, back), front + back
    seen = fewer_rays >= np.maximum(SIDES.least_share * all_rays, SIDES.least_rays)
    seen |= fewer_rays >= np.maximum(SIDES.least_share / 2 * all_rays, LEVELS.few)
    both = (seen & bordered & one_surface)[sheet]
    return both, np.where(front >= back, 1, -1)[sheet] * orientation.astype(np.float32)


def substantial(mesh: Mesh, both: np.ndarray) -> np.ndarray:
    """Those of the triangles `both` that are a substantial part of their object or of the room, (t,) bool."""
    _, area = mesh.geometry
    count = int(mesh.object_id.max()) + 1
    object_area, two_sided_area = (np.bincount(mesh.object_id, weight, count) for weight in (area, area * both))
    large = (two_sided_area >= SIDES.least_of_object * object_area) | (
        two_sided_area >= SIDES.least_of_room * area.sum()
    )
    return both & large[mesh.object_id]


def with_backs(mesh: Mesh, chosen: np.ndarray) -> Mesh:
    """The mesh with a second side for some of its triangles ((s,) int, sorted); itself for none.

    Its last s triangles are those of `chosen` turned over, on vertices of their own in the same places.
    """
    if not len(chosen):
        return mesh
    used, corners = np.unique(mesh.triangles[chosen], return_inverse=True)
    backs = flipped(corners.reshape(-1, 3) + len(mesh.vertices)).astype(mesh.triangles.dtype)
    return replace(
        mesh,
        vertices=np.concatenate([mesh.vertices, mesh.vertices[used]]),
        triangles=np.concatenate([mesh.triangles, backs]),
        object_id=np.concatenate([mesh.object_id, mesh.object_id[chosen]]),
        uv=None if mesh.uv is None else np.concatenate([mesh.uv, flipped(mesh.uv[chosen])]),
        backs=np.asarray(chosen, np.int32),
        far=None if mesh.far is None else np.concatenate([mesh.far, mesh.far[chosen]]),
    )


def fronts(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
    """The mesh without second sides, and the triangle of it that each of the t triangles lies in, (t,) int."""
    if mesh.backs is None:
        return mesh, np.arange(len(mesh.triangles))
    count = len(mesh.triangles) - len(mesh.backs)
    uv = None if mesh.uv is None else mesh.uv[:count]
    far = None if mesh.far is None else mesh.far[:count]
    single = replace(
        mesh, triangles=mesh.triangles[:count], object_id=mesh.object_id[:count], uv=uv, backs=None, far=far
    )
    return single, np.r_[np.arange(count), mesh.backs]


def laid_apart(mesh: Mesh, vertices: np.ndarray) -> Mesh:
    """The mesh with a gap between its sheets' two sides (`with_backs`), as a renderer needs it.

    First sides lie where their `vertices` ((v, 3) float64) are wanted; each second one has three vertices of its own.
    """
    single, _ = fronts(mesh)
    if mesh.backs is None:
        return replace(mesh, vertices=vertices)
    single = replace(single, vertices=vertices, triangles=single.triangles[mesh.backs], uv=None)
    points, faces, _ = welded(single)
    corners = points[faces]
    face_normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face_normal /= np.maximum(np.linalg.norm(face_normal, axis=1, keepdims=True), 1e-30)
    direction = point_normals(points, faces)[faces]
    upright = (np.einsum("tkj,tj->tk", direction, face_normal) >= SIDES.upright).all(1)
    direction[~upright] = face_normal[~upright, None]
    low, high = vertices.min(0), vertices.max(0)
    # Far from the origin float32, which renderers work in, is coarser than that.
    resolution = float(np.spacing(np.float32(np.abs([low, high]).max())))
    gap = max(SIDES.gap * float(np.linalg.norm(high - low)), 8 * resolution)
    count = len(mesh.triangles) - len(mesh.backs)
    backs = np.arange(len(vertices), len(vertices) + 3 * len(mesh.backs)).reshape(-1, 3)
    return replace(
        mesh,
        vertices=np.concatenate([vertices, flipped(corners - gap * direction).reshape(-1, 3)]),
        triangles=np.concatenate([mesh.triangles[:count], backs]).astype(mesh.triangles.dtype),
    )
