"""Atlas coordinates for a mesh that the artist has edited, from the mesh that the atlas was made for."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix
from scipy.spatial import cKDTree

from ..data.arrays import faces_of, layer_of, read, set_layer, vertices_of
from ..data.mesh_objects import ATLAS_UV
from ..own_scene.mesh import same_topology


def atlas_onto(data: bpy.types.Mesh, place: Matrix, source: bpy.types.Mesh, source_place: Matrix) -> None:
    """Give an edited mesh the atlas coordinates of `source`, each mesh standing at its place.

    Where only vertices were moved, those of the same corner. Else each face continues the map of that triangle of
    `source` whose middle is nearest to its own, so that no face is spread over two islands of the atlas.
    """
    if not len(data.polygons) or not len(source.polygons) or ATLAS_UV not in source.uv_layers:
        return
    uv = layer_of(source, ATLAS_UV)
    if same_topology(data, source):
        set_layer(data, ATLAS_UV, uv).active_render = True
        return
    corners = _corners(source, source_place)
    triangles, maps = corners.reshape(-1, 3, 3), uv.reshape(-1, 3, 2)
    total = read(data.polygons, "loop_total", kind=np.int32)
    face = np.repeat(np.arange(len(total)), total)
    own = _corners(data, place)
    middle = np.stack([np.bincount(face, own[:, axis], len(total)) for axis in range(3)], 1) / total[:, None]
    nearest = cKDTree(triangles.mean(1)).query(middle)[1][face]
    first = triangles[nearest, 0]
    edges = triangles[nearest, 1:] - first[:, None]
    # Least squares on the triangle's plane; a sliver's pseudo-inverse stays finite.
    share = np.einsum("ijk,ik->ij", np.linalg.pinv(edges.transpose(0, 2, 1)), own - first)
    steps = maps[nearest, 1:] - maps[nearest, :1]
    new = (maps[nearest, 0] + np.einsum("ij,ijk->ik", share, steps)).clip(0, 1)
    set_layer(data, ATLAS_UV, new).active_render = True


def _corners(data: bpy.types.Mesh, place: Matrix) -> np.ndarray:
    """Where each corner of a mesh is that stands at a place, (c, 3)."""
    return vertices_of(data, place)[faces_of(data)[1]]
