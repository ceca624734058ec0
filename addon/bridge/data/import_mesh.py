"""Meshes that the core has no reader for, through Blender's importers; what is open in Blender stays as it is."""

import re
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

from ...core.errors import BadInputError
from ...core.io.gltf_nodes import Placed
from ...core.io.layout import Faces, RawMesh
from ...core.io.self_contained import Copy, copy_gltf, copy_obj
from ..refused import reason_of
from .added import scene_apart
from .arrays import layer_of, read, triangles_of, vertices_of
from .names import split_number
from .shown import in_window

PART, MATERIAL = re.compile(r"^part (\d+)"), re.compile(r"^material (\d+)")


def import_mesh(path: Path) -> RawMesh:
    """Read an OBJ, glTF or GLB file: polygons as triangles, each object (or group) an instance of its name.

    OBJ as it is, glTF turned to +Z up; `object_id` is None for one object. Raises `BadInputError`: the file is absent,
    damaged, holds no surface, or names files elsewhere.
    """
    path = Path(path)
    if not path.is_file():
        raise BadInputError(
            f"Mesh '{path}' {'is not a file' if path.exists() else 'does not exist'}; a capture needs its mesh there."
        )
    try:
        with (
            tempfile.TemporaryDirectory(prefix="scan_relight_") as folder,
            scene_apart("Scan Relight import") as (scene, added),
        ):
            copy = _import(path, Path(folder), scene)
            scene.view_layers[0].update()  # world matrices
            # Not all_objects: making that list takes its length squared.
            parts = _parts(added.new("objects"), copy.placed)
    except OSError as error:
        reason = error.strerror or error
        raise BadInputError(
            f"Mesh '{path}' can't be read ({reason}); check the file, its rights and the space for temporary files."
        ) from error
    except MemoryError as error:
        raise BadInputError(f"Mesh '{path}' does not fit in memory; simplify it.") from error
    if not parts:
        raise BadInputError(f"Mesh '{path}' holds no surface that Blender can read; export it again.")
    return _joined(parts, path.name, copy)


def _import(path: Path, folder: Path, scene: bpy.types.Scene) -> Copy:
    """Run Blender's importer on a copy of `path` that refers to no other file."""
    with in_window(scene):
        try:
            if path.suffix.lower() == ".obj":
                copy = copy_obj(path, folder)
                settings = {"forward_axis": "Y", "up_axis": "Z", "validate_meshes": True}
                settings |= {"use_split_objects": copy.named, "use_split_groups": not copy.named}
                bpy.ops.wm.obj_import(filepath=str(copy.path), **settings)
                return copy
            copy = copy_gltf(path, folder)
            if not hasattr(bpy.types, "IMPORT_SCENE_OT_gltf"):  # its add-on is switched off
                import addon_utils

                addon_utils.enable("io_scene_gltf2")
            bpy.ops.import_scene.gltf(filepath=str(copy.path), import_shading="FLAT", merge_vertices=False)
            return copy
        except (RuntimeError, AttributeError) as error:  # how an operator reports any failure
            raise BadInputError(
                f"Mesh '{path}' can't be read by Blender ({reason_of(error)[-150:]}); export it again."
            ) from error


class _Part(NamedTuple):
    """World positions (v, 3) float64, triangles (t, 3), texture coordinates (t, 3, 2) if any, materials (t,).

    `face` is the polygon of each triangle, (t,), of `polygons`; in the file come `first` faces before.
    """

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray | None
    material: np.ndarray
    face: np.ndarray
    polygons: int
    first: int


def _parts(objects: list[bpy.types.Object], placed: list[Placed]) -> list[_Part]:
    """The parts by their names; those of one name in the file's order."""
    places: dict[int, list[tuple[int, Placed]]] = {}
    for order, placement in enumerate(placed):
        places.setdefault(placement.mesh, []).append((order, placement))
    parts = []
    for obj in objects:
        triangles = triangles_of(obj.data) if obj.type == "MESH" else ()
        if not len(triangles):
            continue
        layer, match = obj.data.uv_layers.active, PART.match(obj.name)
        uv = layer and layer_of(obj.data, layer.name)[triangles_of(obj.data, "loops")]
        vertices, material = vertices_of(obj.data, obj.matrix_world), _materials(obj.data)
        face = read(obj.data.loop_triangles, "polygon_index", kind=np.int32), len(obj.data.polygons)
        unnamed = [(len(parts), Placed(0, obj.name, np.eye(4)))]
        for order, placement in places.get(int(match[1]), unnamed) if match else unnamed:
            corners = triangles, uv
            if np.linalg.det(placement.matrix[:3, :3]) < 0:  # its triangles are wound the other way
                corners = triangles[:, [0, 2, 1]], None if uv is None else uv[:, [0, 2, 1]]
            name, number = split_number(placement.name)
            moved = vertices @ placement.matrix[:3, :3].T + placement.matrix[:3, 3]
            part = _Part(name, moved, *corners, material, *face, placement.first)
            parts.append(((name, number, order), part))
    return [part for _, part in sorted(parts, key=lambda item: item[0])]


def _materials(data: bpy.types.Mesh) -> np.ndarray:
    """The number in the file of each triangle's material, -1 for none, (t,) int32."""
    matches = [MATERIAL.match(material.name) if material else None for material in data.materials]
    number = np.array([int(match[1]) if match else -1 for match in matches] or [-1], np.int32)
    return number[np.clip(read(data.loop_triangles, "material_index", kind=np.int32), 0, len(number) - 1)]


def _faces(parts: list[_Part], count: int) -> Faces:
    """Where the parts' polygons are among the file's faces, if all of those became one."""
    begin, in_order = 0, True
    for part in sorted(parts, key=lambda part: part.first):
        in_order &= part.first == begin
        begin += part.polygons
    face = np.concatenate([part.face + part.first for part in parts])
    return Faces(count if in_order and begin == count else -1, face, own_vertices=False)


def _joined(parts: list[_Part], name: str, copy: Copy) -> RawMesh:
    begin = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([part.triangles + first for part, first in zip(parts, begin)]).astype(np.int32)
    uv = None
    if any(part.uv is not None for part in parts):
        blank = [np.zeros((len(part.triangles), 3, 2), np.float32) for part in parts]
        uv = np.concatenate([zeros if part.uv is None else part.uv for part, zeros in zip(parts, blank)])
    material, faces = np.concatenate([part.material for part in parts]), _faces(parts, copy.faces)
    mesh = RawMesh(vertices, triangles, None, uv, None, name, None, material, copy.materials, faces)
    if len(parts) == 1:
        return mesh
    ids = np.repeat(np.arange(len(parts)), [len(part.triangles) for part in parts])
    return replace(mesh, object_id=ids, names={i: part.name for i, part in enumerate(parts)})
