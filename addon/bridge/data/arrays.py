"""Blender's meshes as arrays, and back."""

import bpy
import numpy as np


def read(items: bpy.types.bpy_prop_collection, name: str, width: int = 1, kind: type = np.float32) -> np.ndarray:
    """An attribute of all items, (n,), or (n, `width`) where it has several numbers."""
    values = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


def vertices_of(data: bpy.types.Mesh, matrix_world=None) -> np.ndarray:
    """Vertices of a mesh, (v, 3): float32 in its own space; float64 in world space with `matrix_world` (4 x 4)."""
    values = read(data.vertices, "co", 3)
    if matrix_world is None:
        return values
    matrix = np.array(matrix_world, np.float64)
    return values.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def faces_of(data: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """First corner of each face, and the end, (f + 1,); vertex of each corner, (c,); both int32."""
    starts = np.append(read(data.polygons, "loop_start", kind=np.int32), np.int32(len(data.loops)))
    return starts, read(data.loops, "vertex_index", kind=np.int32)


def triangles_of(data: bpy.types.Mesh, attribute: str = "vertices") -> np.ndarray:
    """The triangles that a mesh's faces are cut into: their vertices, or corners ('loops'); (t, 3) int32."""
    data.calc_loop_triangles()
    return read(data.loop_triangles, attribute, 3, np.int32)


def layer_of(data: bpy.types.Mesh, name: str) -> np.ndarray:
    """Coordinates of each corner in one of a mesh's UV maps, (c, 2) float32."""
    return read(data.uv_layers[name].uv, "vector", 2)


def set_layer(data: bpy.types.Mesh, name: str, values: np.ndarray) -> bpy.types.MeshUVLoopLayer | None:
    """Put coordinates of each corner, (c, 2) float, into a UV map, made where absent; None where there is no room."""
    layer = data.uv_layers.get(name) or data.uv_layers.new(name=name, do_init=False)
    if layer is not None:
        layer.uv.foreach_set("vector", np.ascontiguousarray(values, np.float32).ravel())
    return layer


def make_mesh(name: str, vertices: np.ndarray, corners: np.ndarray, starts: np.ndarray | None = None) -> bpy.types.Mesh:
    """A mesh shaded flat.

    Parameters
    ----------
    vertices : (v, 3) float
    corners : (c,) or (f, k) int
        Vertex of each corner; its loops have the same order.
    starts : (f,) int, optional
        First corner of each face; not where all have k.
    """
    starts = np.arange(0, corners.size, corners.shape[1]) if starts is None else starts
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(vertices))
    data.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    data.loops.add(corners.size)
    data.loops.foreach_set("vertex_index", np.ascontiguousarray(corners, np.int32).ravel())
    data.polygons.add(len(starts))
    data.polygons.foreach_set("loop_start", np.ascontiguousarray(starts, np.int32))
    data.shade_flat()
    data.update(calc_edges=True)
    return data
