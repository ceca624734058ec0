"""Atlas coordinates for a mesh that the artist has edited, from the mesh that the atlas was made for."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix
from scipy.spatial import cKDTree

from ..data.mesh_objects import ATLAS_UV
from ..own_scene.mesh import same_topology


def layer_values(data: bpy.types.Mesh, name: str = ATLAS_UV) -> np.ndarray:
    """Coordinates of each corner in one of a mesh's UV maps, (c, 2) float32."""
    values = np.empty(2 * len(data.loops), np.float32)
    data.uv_layers[name].uv.foreach_get("vector", values)
    return values.reshape(-1, 2)


def set_layer(data: bpy.types.Mesh, values: np.ndarray, name: str = ATLAS_UV) -> None:
    """Put coordinates of each corner into one of a mesh's UV maps, made where absent."""
    layer = data.uv_layers.get(name) or data.uv_layers.new(name=name, do_init=False)
    layer.uv.foreach_set("vector", np.ascontiguousarray(values, np.float32).ravel())
    if name == ATLAS_UV:
        data.uv_layers[name].active_render = True


def atlas_onto(data: bpy.types.Mesh, place: Matrix, source: bpy.types.Mesh, source_place: Matrix) -> None:
    """Give an edited mesh the atlas coordinates of `source`, each mesh standing at its place.

    Where only vertices were moved, those of the same corner. Else each face continues the map of that triangle of
    `source` whose middle is nearest to its own, so that no face is spread over two islands of the atlas.
    """
    if not len(data.polygons) or not len(source.polygons) or ATLAS_UV not in source.uv_layers:
        return
    uv = layer_values(source)
    if same_topology(data, source):
        set_layer(data, uv)
        return
    corners = _corners(source, source_place)
    triangles, maps = corners.reshape(-1, 3, 3), uv.reshape(-1, 3, 2)
    total = np.empty(len(data.polygons), np.int32)
    data.polygons.foreach_get("loop_total", total)
    face = np.repeat(np.arange(len(total)), total)
    own = _corners(data, place)
    middle = np.stack([np.bincount(face, own[:, axis], len(total)) for axis in range(3)], 1) / total[:, None]
    nearest = cKDTree(triangles.mean(1)).query(middle)[1][face]
    first = triangles[nearest, 0]
    edges = triangles[nearest, 1:] - first[:, None]
    # Least squares on the triangle's plane; a sliver's pseudo-inverse stays finite.
    share = np.einsum("ijk,ik->ij", np.linalg.pinv(edges.transpose(0, 2, 1)), own - first)
    steps = maps[nearest, 1:] - maps[nearest, :1]
    set_layer(data, (maps[nearest, 0] + np.einsum("ij,ijk->ik", share, steps)).clip(0, 1))


def _corners(data: bpy.types.Mesh, place: Matrix) -> np.ndarray:
    """Where each corner of a mesh is that stands at a place, (c, 3)."""
    vertices = np.empty(3 * len(data.vertices), np.float32)
    data.vertices.foreach_get("co", vertices)
    index = np.empty(len(data.loops), np.int32)
    data.loops.foreach_get("vertex_index", index)
    matrix = np.array(place)
    return vertices.reshape(-1, 3)[index] @ matrix[:3, :3].T + matrix[:3, 3]
