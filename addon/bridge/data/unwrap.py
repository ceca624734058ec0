"""The atlas's layout: all triangles of a room side by side in one square, by Blender's own operators.

`smart_project` makes the islands, `pack_islands` places them. Between the two, sheets that the projection laid on each
other become islands of their own, and islands that waste the square are cut.
"""

from typing import NamedTuple

import bpy
import numpy as np

from ...core.scene.model import Mesh
from ...core.scene.params import SURFACE
from ...core.scene.unwrap import of_parts
from ...core.scene.uv_islands import areas, connected, corner_ids, cut_sparse
from ...core.scene.uv_overlap import layers, overlapping_pairs
from .added import scene_apart
from .arrays import layer_of, make_mesh, set_layer
from .shown import in_window

_PROJECTION = dict(angle_limit=1.15, island_margin=0.0, area_weight=0.0, correct_aspect=False, scale_to_bounds=False)
_PACKING = dict(rotate=True, scale=True, margin_method="ADD", shape_method="AABB", udim_source="CLOSEST_UDIM")
"""Settings of Blender's two operators."""
_EXPECTED_FILL = 0.6
_LAYER = "ScanRelight"


class Polygons(NamedTuple):
    """The faces that a mesh's triangles were cut from.

    Attributes
    ----------
    start : (p + 1,) int
        First corner of each face, and the end.
    vertex : (c,) int
        Vertex of the mesh at each corner.
    corner : (t, 3) int
        The corners of each triangle, all of one face.
    """

    start: np.ndarray
    vertex: np.ndarray
    corner: np.ndarray

    @property
    def face(self) -> np.ndarray:
        """Face of each triangle, (t,) int64."""
        return np.searchsorted(self.start, self.corner[:, 0], "right") - 1


@of_parts
def unwrap(mesh: Mesh, size: int = 4096, margin_texels: float = 2.0, polygons: Polygons | None = None) -> np.ndarray:
    """Lay the room out flat without overlap, all surfaces at nearly one scale.

    Works on a temporary object in a temporary scene: the user's scene, selection and mode stay as they are.

    Parameters
    ----------
    size : int
        Edge of the atlas in texels; margin and tolerance count in these.
    margin_texels : float
        Empty texels between two islands.
    polygons : Polygons, optional
        Keep the triangles of each face together, so that its corners have one coordinate each. A face that folds onto
        itself is torn all the same. Further triangles of the mesh, the second sides of sheets, are faces each.

    Returns
    -------
    uv : (t, 3, 2) float32
        In [0, 1]. No two triangles penetrate each other by more than `SURFACE.overlap_texels`. Triangles that repeat a
        vertex lie in the lower left corner, without area.
    """
    if not len(mesh.triangles):
        return np.zeros((0, 3, 2), np.float32)
    a, b, c = mesh.triangles.T
    valid = (a != b) & (b != c) & (c != a)  # Blender can't hold others
    triangles, object_id = mesh.triangles[valid], mesh.object_id[valid]
    uv = np.zeros((len(mesh.triangles), 3, 2), np.float32)
    if polygons is not None:
        polygons = _with_more(polygons, mesh.triangles)
        polygons = polygons._replace(corner=polygons.corner[valid])
    if len(triangles):
        uv[valid] = _unwrapped(mesh.vertices, triangles, object_id, size, margin_texels, polygons)
    return np.clip(uv, 0, 1)


def _with_more(polygons, triangles):
    """The faces, and one for each triangle beyond theirs."""
    extra = triangles[len(polygons.corner) :]
    if not len(extra):
        return polygons
    corner = len(polygons.vertex) + np.arange(extra.size).reshape(-1, 3)
    return Polygons(
        np.r_[polygons.start, corner[:, 2] + 1].astype(polygons.start.dtype),
        np.r_[polygons.vertex, extra.ravel()].astype(polygons.vertex.dtype),
        np.r_[polygons.corner, corner].astype(polygons.corner.dtype),
    )


def _unwrapped(vertices, triangles, object_id, size, margin_texels, polygons):
    # Vertices are split between objects: an island then never spans two of them.
    points, corners = _split(vertices, triangles, object_id)
    if polygons is None:
        uv = _projected(points, corners.ravel(), 3 * np.arange(len(corners))).reshape(-1, 3, 2)
    else:  # parts of the scene share no vertices
        uv = _projected(vertices.astype(np.float32), polygons.vertex, polygons.start[:-1])[polygons.corner]
    ids = corner_ids(corners, uv)
    island = connected(ids)
    pairs = overlapping_pairs(uv, SURFACE.overlap_texels / size, island)
    face, height = np.arange(len(uv)), _height(vertices[triangles], island)
    if polygons is not None:
        face = _faces(polygons.face, pairs)
        height = np.bincount(face, height) / np.bincount(face)
        pairs = np.unique(np.sort(face[pairs], axis=1), axis=0)
    layer = layers(pairs, height)[face]
    if layer.any():
        island = connected(ids, island * (layer.max() + 1) + layer)
    island = cut_sparse(uv, ids, island, margin_texels / size, face)
    points, corners = _split(vertices, triangles, island)
    return _packed(points, corners, uv, size, margin_texels)


def _projected(points, vertex, start):
    """Coordinates of each corner, (c, 2) float32, by Blender's projection of each face along one of few directions."""
    return _laid_out(points, vertex, start, np.zeros((len(vertex), 2)), bpy.ops.uv.smart_project, **_PROJECTION)


def _faces(face, pairs):
    """Numbers of what stays together, (t,): the face of each triangle, or itself where its face folds onto itself."""
    folded = np.unique(face[pairs[face[pairs[:, 0]] == face[pairs[:, 1]]]])
    alone = np.isin(face, folded)
    face = np.where(alone, face.max() + 1 + np.arange(len(face)), face)
    return np.unique(face, return_inverse=True)[1].reshape(-1)


def _packed(points, corners, uv, size, margin_texels):
    """Place the islands, turned freely or by right angles, whichever fills more.

    Boxes are packed, not outlines: now that sparse islands are cut, outlines fill no more and can take minutes.
    """
    uv = (uv * np.sqrt(_EXPECTED_FILL / max(areas(uv).sum(), 1e-12))).astype(np.float32)
    start = 3 * np.arange(len(corners))

    def placed(turn, margin):
        settings = {"rotate_method": turn, "margin": margin, **_PACKING}
        return _laid_out(points, corners.ravel(), start, uv, bpy.ops.uv.pack_islands, **settings).reshape(-1, 3, 2)

    # Blender's margin is one before its own scaling: the scale is guessed, and mended once or twice.
    target = margin = margin_texels / 2 / size
    candidates = ((placed(turn, margin), turn) for turn in ("ANY", "CARDINAL"))
    packed, turn = max(candidates, key=lambda candidate: areas(candidate[0]).sum())
    for _ in range(2):
        border = packed.min()
        if border >= 0.97 * target or border <= 0:
            break
        margin *= 1.05 * target / border
        packed = placed(turn, margin)
    return packed


def _split(vertices, triangles, label):
    """Vertices of their own for each label: (v, 3) float32 and (t, 3) int32."""
    key = label[:, None].astype(np.int64) * len(vertices) + triangles
    names, corners = np.unique(key.ravel(), return_inverse=True)
    return vertices[names % len(vertices)].astype(np.float32), corners.reshape(-1, 3).astype(np.int32)


def _height(corners, island):
    """Height of each triangle over its island's mean plane, (t,) float; `corners` is (t, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    mean = np.stack([np.bincount(island, normal[:, k]) for k in range(3)], -1)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
    return np.einsum("ij,ij->i", corners.mean(1), mean[island])


def _laid_out(points, vertex, start, uv, operator, **settings):
    """Coordinates of each corner, (c, 2) float32, by a UV operator on a mesh in a scene of its own; all gone after it.

    Its faces are given by the vertex of each corner and the first corner of each face; `uv` is what it begins with.
    """
    with scene_apart("Scan Relight unwrap") as (scene, _):
        data = make_mesh("Scan Relight unwrap", points, vertex, start)
        obj = bpy.data.objects.new("Scan Relight unwrap", data)
        set_layer(data, _LAYER, uv)
        scene.collection.objects.link(obj)
        scene.tool_settings.use_uv_select_sync = True
        layer = scene.view_layers[0]
        layer.objects.active = obj
        obj.select_set(True, view_layer=layer)
        with in_window(scene):
            bpy.ops.object.mode_set(mode="EDIT")
            try:
                bpy.ops.mesh.select_all(action="SELECT")
                operator(**settings)
            finally:
                bpy.ops.object.mode_set(mode="OBJECT")
        return np.nan_to_num(layer_of(data, _LAYER), nan=0.0, posinf=0.0, neginf=0.0)
