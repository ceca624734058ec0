"""The room's triangles as Blender objects: one for each instance."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ...core.scene.model import Instance, Mesh
from ..marks import OBJECT_ID

ATLAS_UV = "ScanRelight"
"""Name of the texture coordinates that the recovered images use."""
PARTS_UV = "ScanRelightParts"
"""Of those for images of single objects, or UDIM tiles; absent where one image serves the room."""
CAPTURE_UV = "Capture"
"""Name of the capture's own texture coordinates, where it has any."""


def make_objects(
    mesh: Mesh,
    instances: Iterable[Instance],
    atlas_uv: np.ndarray,
    collection: bpy.types.Collection,
    parts_uv: np.ndarray | None = None,
) -> dict[int, bpy.types.Object]:
    """Make one mesh object for each instance and link it to a collection.

    Parameters
    ----------
    mesh : Mesh
        World positions in metres.
    instances : iterable of Instance
        One without triangles gets no object.
    atlas_uv : (t, 3, 2) float32
        Atlas coordinates of each triangle's corners, in [0, 1].
    collection : bpy.types.Collection
    parts_uv : (t, 3, 2) float32, optional
        See `PARTS_UV`; then these are the active ones.

    Returns
    -------
    dict of int to bpy.types.Object
        By `object_id`. The origin lies in the middle of the object's box; shading is flat, because the scan's
        geometric normals are what the light was divided by.
    """
    return dict(each_object(mesh, instances, atlas_uv, collection, parts_uv))


def each_object(
    mesh: Mesh,
    instances: Iterable[Instance],
    atlas_uv: np.ndarray,
    collection: bpy.types.Collection,
    parts_uv: np.ndarray | None = None,
) -> Iterator[tuple[int, bpy.types.Object]]:
    """`make_objects` one by one, so that a window can be drawn in between."""
    order = np.argsort(mesh.object_id, kind="stable")
    sorted_id = mesh.object_id[order]
    for instance in instances:
        first, last = np.searchsorted(sorted_id, [instance.object_id, instance.object_id + 1])
        if first == last:
            continue
        own = order[first:last]
        vertices, triangles = _compact(mesh.vertices, mesh.triangles[own])
        middle = (vertices.min(0) + vertices.max(0)) / 2
        data = mesh_data(instance.name, vertices - middle, triangles)
        _add_uv(data, ATLAS_UV, atlas_uv[own])
        if mesh.uv is not None:
            _add_uv(data, CAPTURE_UV, mesh.uv[own])
        if parts_uv is not None:
            _add_uv(data, PARTS_UV, parts_uv[own])
        shown = data.uv_layers[ATLAS_UV if parts_uv is None else PARTS_UV]
        data.uv_layers.active, shown.active_render = shown, True
        thing = bpy.data.objects.new(instance.name, data)
        thing.location = middle
        thing[OBJECT_ID] = int(instance.object_id)
        collection.objects.link(thing)
        yield instance.object_id, thing


def is_open(data: bpy.types.Mesh) -> bool:
    """Whether a mesh is a sheet: has edges with one face only."""
    edge = np.empty(len(data.loops), np.int32)
    data.loops.foreach_get("edge_index", edge)
    return bool((np.bincount(edge, minlength=len(data.edges)) == 1).any())


def mesh_data(name: str, vertices: np.ndarray, triangles: np.ndarray) -> bpy.types.Mesh:
    """Make a flat-shaded mesh.

    Parameters
    ----------
    name : str
    vertices : (v, 3) float
        Metres.
    triangles : (t, 3) int

    Returns
    -------
    bpy.types.Mesh
        Loop k of triangle i is loop 3 i + k.
    """
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(vertices))
    data.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    data.loops.add(triangles.size)
    data.loops.foreach_set("vertex_index", np.ascontiguousarray(triangles, np.int32).ravel())
    data.polygons.add(len(triangles))
    data.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    data.shade_flat()
    data.update(calc_edges=True)
    return data


def _compact(vertices, triangles):
    """Only the vertices in use, renumbered. Triangles that repeat a vertex are dropped by no one: they show nothing."""
    used, corners = np.unique(triangles.ravel(), return_inverse=True)
    return vertices[used], corners.reshape(-1, 3)


def _add_uv(data, name, uv):
    layer = data.uv_layers.new(name=name, do_init=False)
    layer.data.foreach_set("uv", np.ascontiguousarray(uv, np.float32).ravel())
