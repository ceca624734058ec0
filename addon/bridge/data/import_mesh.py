"""Meshes that the core has no reader for, through Blender's importers; what is open in Blender stays as it is."""

from __future__ import annotations

import contextlib
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import BadInputError
from ...core.io.layout import RawMesh
from ...core.io.self_contained import copy_gltf, copy_obj
from ..refused import reason_of
from .added import Made
from .arrays import layer_of, triangles_of, vertices_of

NUMBERED = re.compile(r"^(.*?)(?:\.(\d{3,}))?$", re.DOTALL)
"""Blender's ending of a name that was taken already."""


def import_mesh(path: Path) -> RawMesh:
    """Read an OBJ, glTF or GLB file: polygons as triangles, each object (or group) an instance of its name.

    An OBJ file's coordinates are taken as they are; glTF's, which are +Y up, are turned to +Z up. Materials and
    pictures are not looked at. Where there is but one object, `object_id` is None. Raises `BadInputError`: the file is
    absent, damaged, holds no surface, or names files elsewhere.
    """
    path = Path(path)
    if not path.is_file():
        raise BadInputError(
            f"Mesh '{path}' {'is not a file' if path.exists() else 'does not exist'}; a capture needs its mesh there."
        )
    try:
        with tempfile.TemporaryDirectory(prefix="scan_relight_") as folder, _scene_apart() as scene:
            _import(path, Path(folder), scene)
            parts = _parts(scene)
    except OSError as error:
        reason = error.strerror or error
        raise BadInputError(
            f"Mesh '{path}' can't be read ({reason}); check the file, its rights and the space for temporary files."
        ) from error
    except MemoryError as error:
        raise BadInputError(f"Mesh '{path}' does not fit in memory; simplify it.") from error
    if not parts:
        raise BadInputError(f"Mesh '{path}' holds no surface that Blender can read; export it again.")
    return _joined(parts, path.name)


def _import(path: Path, folder: Path, scene: bpy.types.Scene) -> None:
    """Run Blender's importer on a copy of `path` that names nothing else."""
    with bpy.context.temp_override(
        scene=scene,
        view_layer=scene.view_layers[0],
        collection=scene.collection,
        layer_collection=scene.view_layers[0].layer_collection,
    ):
        try:
            if path.suffix.lower() == ".obj":
                copy, named = copy_obj(path, folder)
                bpy.ops.wm.obj_import(
                    filepath=str(copy),
                    forward_axis="Y",
                    up_axis="Z",
                    use_split_objects=named,
                    use_split_groups=not named,
                    validate_meshes=True,
                )
                return
            copy = copy_gltf(path, folder)
            if not hasattr(bpy.types, "IMPORT_SCENE_OT_gltf"):  # its add-on is switched off
                import addon_utils

                addon_utils.enable("io_scene_gltf2")
            bpy.ops.import_scene.gltf(filepath=str(copy), import_shading="FLAT", merge_vertices=False)
        except (RuntimeError, AttributeError) as error:  # how an operator tells of anything that went wrong
            raise BadInputError(
                f"Mesh '{path}' can't be read by Blender ({reason_of(error)[-150:]}); export it again."
            ) from error


@contextlib.contextmanager
def _scene_apart() -> Iterator[bpy.types.Scene]:
    """A scene of its own; it goes with all that came into it, and nothing else changes."""
    made = Made()
    scene = bpy.data.scenes.new("Scan Relight import")
    try:
        yield scene
    finally:
        made.remove()


def _parts(scene: bpy.types.Scene) -> list[tuple[str, np.ndarray, np.ndarray, np.ndarray | None]]:
    """Name, vertices, triangles and texture coordinates of each object with a surface, in the order of their names."""
    scene.view_layers[0].update()  # world matrices of children
    found = []
    for thing in scene.collection.all_objects:
        if thing.type == "MESH":
            name, number = NUMBERED.match(thing.name).groups()
            vertices, triangles, uv = _geometry(thing.data, np.array(thing.matrix_world, np.float64))
            if len(triangles):
                found.append(((name, int(number or 0)), vertices, triangles, uv))
    return [(name, *rest) for (name, _), *rest in sorted(found, key=lambda part: part[0])]


def _geometry(mesh: bpy.types.Mesh, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """World positions ((v, 3) float64), triangles ((t, 3) int32) and texture coordinates of their corners."""
    triangles, layer = triangles_of(mesh), mesh.uv_layers.active
    uv = None if layer is None else layer_of(mesh, layer.name)[triangles_of(mesh, "loops")]
    if np.linalg.det(matrix[:3, :3]) < 0:  # a mirrored object's triangles are wound the other way
        triangles = triangles[:, [0, 2, 1]]
        uv = None if uv is None else uv[:, [0, 2, 1]]
    return vertices_of(mesh, matrix), triangles, uv


def _joined(parts: list, name: str) -> RawMesh:
    """One mesh; the parts are its objects if there are several."""
    begin = np.cumsum([0, *(len(vertices) for _, vertices, _, _ in parts)])
    vertices = np.concatenate([vertices for _, vertices, _, _ in parts])
    triangles = np.concatenate([part[2] + offset for part, offset in zip(parts, begin)]).astype(np.int32)
    uv = None
    if any(part[3] is not None for part in parts):
        uv = np.concatenate(
            [np.zeros((len(part[2]), 3, 2), np.float32) if part[3] is None else part[3] for part in parts]
        )
    if len(parts) == 1:
        return RawMesh(vertices, triangles, uv=uv, name=name)
    ids = np.repeat(np.arange(len(parts)), [len(part[2]) for part in parts])
    return RawMesh(vertices, triangles, ids, uv, {i: part[0] for i, part in enumerate(parts)}, name)
