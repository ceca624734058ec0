"""The room's triangles as Blender objects: one for each instance that is no part of another."""

from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ...core.groups import by_number
from ...core.scene.model import Instance, Mesh
from ...core.scene.shells import bulges
from ..custom_properties import OBJECT_ID
from .arrays import make_mesh, read, set_layer

ATLAS_UV = "ScanRelight"
"""Name of the texture coordinates that the recovered images use."""
PARTS_UV = "ScanRelightParts"
"""Of those for images of single objects, or UDIM tiles; absent where one image serves the room."""
CAPTURE_UV = "Capture"
"""Name of the capture's own texture coordinates, where it has any."""
FAR = "scan_relight_far"
"""Name of the faces' attribute that is true of those of other parts of a building (`Mesh.far`); absent without any."""


def by_object(mesh: Mesh, instances: Iterable[Instance]) -> dict[int, list[Instance]]:
    """The instances that each object shows, in the order of its material slots, by the `object_id` of the first.

    A part shares the object of what it is part of; one of what has no triangles has an object of its own. Instances
    without triangles are left out.
    """
    present = set(np.unique(mesh.object_id).tolist())
    visible = [instance for instance in instances if instance.object_id in present]
    whole_of = {instance.object_id: instance.part_of for instance in visible if instance.part_of in present}
    groups = {instance.object_id: [instance] for instance in visible if instance.object_id not in whole_of}
    for instance in visible:
        whole = instance.object_id
        while whole in whole_of:  # a run may find parts of a part that was given
            whole = whole_of[whole]
        if whole != instance.object_id:
            groups[whole].append(instance)
    return groups


def each_object(
    mesh: Mesh,
    instances: Iterable[Instance],
    atlas_uv: np.ndarray,
    collection: bpy.types.Collection,
    parts_uv: np.ndarray | None = None,
) -> Iterator[tuple[int, bpy.types.Object]]:
    """Make the objects of `by_object` and link them to a collection, one by one: a window can be drawn in between.

    Parameters
    ----------
    mesh : Mesh
        World positions in metres.
    atlas_uv : (t, 3, 2) float32
        Atlas coordinates of each triangle's corners, in [0, 1].
    parts_uv : (t, 3, 2) float32, optional
        See `PARTS_UV`; then these are the active ones.

    Yields
    ------
    int, bpy.types.Object
        `object_id` of the main part, and the object; its faces index a material slot for each part. The origin lies
        in the middle of the object's box; shading is flat, because the scan's geometric normals are what the light was
        divided by.
    """
    triangles = by_number(mesh.object_id)
    for object_id, parts in by_object(mesh, instances).items():
        of_parts = [triangles[part.object_id] for part in parts]
        indices = np.concatenate(of_parts)
        # Triangles that repeat a vertex are not dropped: they are invisible.
        vertex_ids, corners = np.unique(mesh.triangles[indices].ravel(), return_inverse=True)
        vertices = mesh.vertices[vertex_ids]
        centre = (vertices.min(0) + vertices.max(0)) / 2
        data = make_mesh(parts[0].name, vertices - centre, corners.reshape(-1, 3))
        for name, uv in ((ATLAS_UV, atlas_uv), (CAPTURE_UV, mesh.uv), (PARTS_UV, parts_uv)):
            if uv is not None:
                set_layer(data, name, uv[indices])
        if len(parts) > 1:
            slots = np.repeat(np.arange(len(parts), dtype=np.int32), list(map(len, of_parts)))
            data.polygons.foreach_set("material_index", slots)
        if mesh.far is not None and mesh.far[indices].any():
            data.attributes.new(FAR, "BOOLEAN", "FACE").data.foreach_set("value", mesh.far[indices])
        layer = data.uv_layers[ATLAS_UV if parts_uv is None else PARTS_UV]
        data.uv_layers.active, layer.active_render = layer, True
        obj = bpy.data.objects.new(parts[0].name, data)
        obj.location = centre
        obj[OBJECT_ID] = int(object_id)
        collection.objects.link(obj)
        yield object_id, obj


def is_one_sided(data: bpy.types.Mesh, parts_guessed: bool) -> bool:
    """Whether a lamp of this mesh shines on the side alone that its normals show.

    It does if it is open (has edges with one face only), unless it is of a mesh without objects, whose parts were
    guessed, and bulges (`shells.bulges`).
    """
    edges = read(data.loops, "edge_index", kind=np.int32)
    if not (np.bincount(edges, minlength=len(data.edges)) == 1).any():
        return False
    return not (parts_guessed and bulges(read(data.polygons, "normal", 3), read(data.polygons, "area")))
