"""The room's triangles as Blender objects: one for each instance."""

from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ...core.groups import by_number
from ...core.scene.model import Instance, Mesh
from ..custom_properties import OBJECT_ID
from .arrays import make_mesh, read, set_layer

ATLAS_UV = "ScanRelight"
"""Name of the texture coordinates that the recovered images use."""
PARTS_UV = "ScanRelightParts"
"""Of those for images of single objects, or UDIM tiles; absent where one image serves the room."""
CAPTURE_UV = "Capture"
"""Name of the capture's own texture coordinates, where it has any."""


def each_object(
    mesh: Mesh,
    instances: Iterable[Instance],
    atlas_uv: np.ndarray,
    collection: bpy.types.Collection,
    parts_uv: np.ndarray | None = None,
) -> Iterator[tuple[int, bpy.types.Object]]:
    """Make one mesh object for each instance and link it to a collection, one by one: a window can be drawn in between.

    Parameters
    ----------
    mesh : Mesh
        World positions in metres.
    instances : iterable of Instance
        One without triangles gets no object.
    atlas_uv : (t, 3, 2) float32
        Atlas coordinates of each triangle's corners, in [0, 1].
    parts_uv : (t, 3, 2) float32, optional
        See `PARTS_UV`; then these are the active ones.

    Yields
    ------
    int, bpy.types.Object
        `object_id` and the object. The origin lies in the middle of the object's box; shading is flat, because the
        scan's geometric normals are what the light was divided by.
    """
    triangles = by_number(mesh.object_id)
    for instance in instances:
        indices = triangles.get(instance.object_id)
        if indices is None:
            continue
        # Triangles that repeat a vertex are not dropped: they are invisible.
        vertex_ids, corners = np.unique(mesh.triangles[indices].ravel(), return_inverse=True)
        vertices = mesh.vertices[vertex_ids]
        centre = (vertices.min(0) + vertices.max(0)) / 2
        data = make_mesh(instance.name, vertices - centre, corners.reshape(-1, 3))
        for name, uv in ((ATLAS_UV, atlas_uv), (CAPTURE_UV, mesh.uv), (PARTS_UV, parts_uv)):
            if uv is not None:
                set_layer(data, name, uv[indices])
        layer = data.uv_layers[ATLAS_UV if parts_uv is None else PARTS_UV]
        data.uv_layers.active, layer.active_render = layer, True
        obj = bpy.data.objects.new(instance.name, data)
        obj.location = centre
        obj[OBJECT_ID] = int(instance.object_id)
        collection.objects.link(obj)
        yield instance.object_id, obj


def is_open(data: bpy.types.Mesh) -> bool:
    """Whether a mesh is open: has edges with one face only."""
    edges = read(data.loops, "edge_index", kind=np.int32)
    return bool((np.bincount(edges, minlength=len(data.edges)) == 1).any())
