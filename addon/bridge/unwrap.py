"""The atlas's layout: all triangles of a room side by side in one square, by Blender's own operators.

`smart_project` makes the islands, `pack_islands` places them. Between the two, sheets that the projection laid on each
other become islands of their own, and islands that waste the square are cut.
"""

from __future__ import annotations

from contextlib import contextmanager

import bpy
import numpy as np

from ..core.capture.model import Mesh
from .uv_islands import areas, connected, corner_ids, cut_sparse
from .uv_overlap import layers, overlapping_pairs

OVERLAP_TEXELS = 0.02
"""Triangles may penetrate each other by this much; far less than what moves a texel's centre, more than rounding."""

_PROJECTION_ANGLE = 1.15
_LAYER = "ScanRelight"
_EXPECTED_FILL = 0.6


def unwrap(mesh: Mesh, size: int = 4096, margin_texels: float = 2.0) -> np.ndarray:
    """Lay the room out flat without overlap, all surfaces at nearly one scale.

    Works on a temporary object in a temporary scene: the user's scene, selection and mode stay as they are.

    Parameters
    ----------
    mesh : Mesh
    size : int
        Edge of the atlas in texels; margin and tolerance count in these.
    margin_texels : float
        Empty texels between two islands.

    Returns
    -------
    uv : (t, 3, 2) float32
        In [0, 1]. No two triangles penetrate each other by more than `OVERLAP_TEXELS`. Triangles that repeat a
        vertex lie in the lower left corner, without area.
    """
    if not len(mesh.triangles):
        return np.zeros((0, 3, 2), np.float32)
    whole = _without_repeats(mesh.triangles)
    triangles, object_id = mesh.triangles[whole], mesh.object_id[whole]
    uv = np.zeros((len(mesh.triangles), 3, 2), np.float32)
    if len(triangles):
        uv[whole] = _unwrapped(mesh.vertices, triangles, object_id, size, margin_texels)
    return np.clip(np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0), 0, 1)


def _unwrapped(vertices, triangles, object_id, size, margin_texels):
    # Vertices are split between objects: an island then never spans two of them.
    points, corners = _split(vertices, triangles, object_id)
    with _temporary(points, corners) as data:
        _operate(data, bpy.ops.uv.smart_project, angle_limit=_PROJECTION_ANGLE, island_margin=0.0, area_weight=0.0,
                 correct_aspect=False, scale_to_bounds=False)
        uv = _layout(data)
    uv = np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0)
    ids = corner_ids(corners, uv)
    island = connected(ids)
    pairs = overlapping_pairs(uv, OVERLAP_TEXELS / size, island)
    layer = layers(pairs, _height(vertices[triangles], island))
    if layer.any():
        island = connected(ids, island * (layer.max() + 1) + layer)
    island = cut_sparse(uv, ids, island, margin_texels / size)
    points, corners = _split(vertices, triangles, island)
    return _packed(points, corners, uv, size, margin_texels)


def _packed(points, corners, uv, size, margin_texels):
    """Place the islands, turned freely or by right angles, whichever fills more.

    Boxes are packed, not outlines: now that sparse islands are cut, outlines fill no more and can take minutes.
    """
    uv = (uv * np.sqrt(_EXPECTED_FILL / max(areas(uv).sum(), 1e-12))).astype(np.float32)
    found = []
    for turn in ("ANY", "CARDINAL"):
        # Blender's margin is one before its own scaling: the scale is guessed, and mended once or twice.
        wanted = margin = margin_texels / 2 / size
        for _ in range(3):
            with _temporary(points, corners) as data:
                data.uv_layers[0].data.foreach_set("uv", uv.ravel())
                _operate(data, bpy.ops.uv.pack_islands, rotate=True, rotate_method=turn, scale=True, margin=margin,
                         margin_method="ADD", shape_method="AABB", udim_source="CLOSEST_UDIM")
                packed = np.nan_to_num(_layout(data), nan=0.0, posinf=0.0, neginf=0.0)
            border = packed.min()
            if border >= 0.97 * wanted or border <= 0:
                break
            margin *= 1.05 * wanted / border
        found.append(packed)
    return max(found, key=lambda packed: areas(packed).sum())


def _without_repeats(triangles):
    """Triangles of three different vertices, (t,) bool; Blender can't hold others."""
    a, b, c = triangles.T
    return (a != b) & (b != c) & (c != a)


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


@contextmanager
def _temporary(points, corners):
    """A mesh of these triangles on an object of a scene of its own; all gone afterwards."""
    scene = bpy.data.scenes.new("Scan Relight unwrap")
    data = bpy.data.meshes.new("Scan Relight unwrap")
    thing = bpy.data.objects.new("Scan Relight unwrap", data)
    try:
        data.vertices.add(len(points))
        data.vertices.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())
        data.loops.add(corners.size)
        data.loops.foreach_set("vertex_index", corners.ravel())
        data.polygons.add(len(corners))
        data.polygons.foreach_set("loop_start", np.arange(0, corners.size, 3, dtype=np.int32))
        data.update(calc_edges=True)
        data.uv_layers.new(name=_LAYER)
        scene.collection.objects.link(thing)
        scene.tool_settings.use_uv_select_sync = True
        yield data
    finally:
        bpy.data.objects.remove(thing)
        bpy.data.meshes.remove(data)
        bpy.data.scenes.remove(scene)


def _operate(data, operator, **settings):
    """Run a UV operator on all of `data` in edit mode, in the context of its own scene."""
    scene = next(s for s in bpy.data.scenes if any(o.data == data for o in s.collection.objects))
    thing = scene.collection.objects[0]
    layer = scene.view_layers[0]
    layer.objects.active = thing
    thing.select_set(True, view_layer=layer)
    context = {"scene": scene, "view_layer": layer, "object": thing, "active_object": thing,
               "selected_objects": [thing]}
    with bpy.context.temp_override(**context):
        bpy.ops.object.mode_set(mode="EDIT")
    try:
        with bpy.context.temp_override(edit_object=thing, **context):
            bpy.ops.mesh.select_all(action="SELECT")
            operator(**settings)
    finally:
        with bpy.context.temp_override(**context):
            bpy.ops.object.mode_set(mode="OBJECT")


def _layout(data):
    """The mesh's texture coordinates, (t, 3, 2) float32."""
    uv = np.empty(len(data.loops) * 2, np.float32)
    data.uv_layers[_LAYER].data.foreach_get("uv", uv)
    return uv.reshape(-1, 3, 2)
