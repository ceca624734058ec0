"""The room as glTF or USD, through Blender's own exporters.

They understand plain Principled materials only. So a copy of each object is exported that shares its mesh and wears
such a material; the copies are deleted afterwards and nothing of the scene has changed.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ..core.errors import BadInputError, StorageError
from .export_material import plain_copy
from .marks import OBJECT_ID
from .materials import opacity

FORMATS = {".glb": "GLB", ".gltf": "GLTF_SEPARATE", ".usdc": "USD", ".usd": "USD", ".usda": "USD", ".usdz": "USD"}
"""By ending."""
ROOM, SELECTED, ALL = "ROOM", "SELECTED", "ALL"
_COLLECTION = "Scan Relight export"


def can_export(ending: str) -> str:
    """'' where this Blender can write files of that ending, else one sentence."""
    if ending not in FORMATS:
        return f"Files ending in '{ending}' can't be written; choose .glb, .gltf, .usdc or .usdz."
    if FORMATS[ending] == "USD" and not bpy.app.build_options.usd:
        return "This Blender was built without USD; choose glTF."
    if FORMATS[ending] != "USD" and not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        return "Blender's glTF exporter is switched off; enable the add-on 'glTF 2.0 format' in the preferences."
    return ""


def export(scene: bpy.types.Scene, path: Path | str, scope: str = ROOM, lights: bool = True,
           cameras: bool = False) -> list[str]:
    """Write a scene's objects with plain materials.

    Parameters
    ----------
    scene : bpy.types.Scene
    path : path
        The ending decides on the format, see `FORMATS`.
    scope : str
        `ROOM`: what was scanned and what was set into it; `SELECTED`: selected meshes; `ALL`: every visible mesh.
    lights, cameras : bool
        Also Blender's lamps; also the scene's camera.

    Returns
    -------
    list of str
        What the format can't hold, one sentence each.

    Raises
    ------
    BadInputError
        Nothing to export, an unknown ending, or this Blender can't write the format.
    StorageError
        The file can't be written.
    """
    path = Path(path).absolute()
    ending = path.suffix.lower()
    problem = can_export(ending)
    if problem:
        raise BadInputError(problem)
    things = chosen(scene, scope)
    if not things:
        raise BadInputError("There is nothing to export: no visible mesh among what was chosen.")
    extra = [thing for thing in scene.objects if not thing.hide_render and (
        lights and thing.type == "LIGHT" or cameras and thing == scene.camera)]
    folder = Path(tempfile.mkdtemp(prefix="scan_relight_"))
    try:
        with copies(scene, things, extra, folder / "textures", FORMATS[ending] != "USD") as collection:
            made = folder / "made"
            made.mkdir()
            try:
                _write(made / path.name, ending, collection)
            except RuntimeError as error:
                reason = " ".join(str(error).split()).removeprefix("Error: ").rstrip(".")
                raise StorageError(f"'{path}' can't be exported ({reason[:300]}).") from error
            _move(made, path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return remarks(ending, things, extra, scene)


def chosen(scene: bpy.types.Scene, scope: str) -> list[bpy.types.Object]:
    """The meshes that a scope means; none that is hidden from renders."""
    if scope not in (ROOM, SELECTED, ALL):
        raise BadInputError(f"There is no scope '{scope}'; choose one of {ROOM}, {SELECTED}, {ALL}.")
    meshes = [thing for thing in scene.objects if thing.type == "MESH" and not thing.hide_render]
    if scope == SELECTED:
        return [thing for thing in meshes if thing.select_get()]
    if scope == ROOM:
        return [thing for thing in meshes if OBJECT_ID in thing or "scan_relight_virtual" in thing]
    return meshes


def remarks(ending: str, things: Iterable[bpy.types.Object], lamps: Iterable[bpy.types.Object],
            scene: bpy.types.Scene) -> list[str]:
    """What a format loses of these, one sentence each."""
    told = []
    if FORMATS[ending] == "USD":
        told.append("USD's preview surface has no one-sided emission and Blender writes no Specular IOR Level to it: "
                    "objects without highlight get an index of refraction of 1 instead.")
        if any(opacity(slot.material) < 0.99 for thing in things for slot in thing.material_slots if slot.material):
            told.append("Blender 5.2 writes no Alpha to USD, so glass may be opaque there; glTF keeps it.")
    else:
        if any(lamp.type == "LIGHT" and lamp.data.type == "AREA" for lamp in lamps):
            told.append("glTF has no area lights, so they are left out.")
        if scene.world is not None and scene.world.node_tree:
            told.append("glTF holds no light from outside, and few viewers light a room by its glowing lamps: add the "
                        "light there.")
    return told


@contextmanager
def copies(scene: bpy.types.Scene, things: Iterable[bpy.types.Object], extra: Iterable[bpy.types.Object],
           textures: Path, level: bool = True) -> Iterator[bpy.types.Collection]:
    """A collection of copies with plain materials; afterwards no trace of it is left.

    `textures` gets the 8-bit sRGB pictures that the materials show; for `level` see `plain_copy`.
    """
    kinds = ("objects", "materials", "images", "collections", "meshes")
    before = {kind: set(getattr(bpy.data, kind)) for kind in kinds}
    try:
        textures.mkdir(parents=True)
        collection = bpy.data.collections.new(_COLLECTION)
        scene.collection.children.link(collection)
        pictures: dict = {}
        plain: dict = {}
        for thing in things:
            copy = thing.copy()
            collection.objects.link(copy)
            copy.parent = None
            copy.matrix_world = thing.matrix_world
            copy.hide_viewport = False
            for own, slot in zip(thing.material_slots, copy.material_slots):
                if own.material is None:
                    continue
                if own.material not in plain:
                    plain[own.material] = plain_copy(own.material, textures, pictures, level)
                slot.link = "OBJECT"
                slot.material = plain[own.material]
        for thing in extra:
            copy = thing.copy()
            collection.objects.link(copy)
            copy.parent = None
            copy.matrix_world = thing.matrix_world
        yield collection
    finally:
        for kind in ("collections", "objects", "materials", "images", "meshes"):
            new = [item for item in getattr(bpy.data, kind) if item not in before[kind]]
            if new:
                bpy.data.batch_remove(new)


def _write(path: Path, ending: str, collection: bpy.types.Collection) -> None:
    """Have Blender's exporter write the collection."""
    if FORMATS[ending] == "USD":
        bpy.ops.wm.usd_export(filepath=str(path), collection=collection.name, export_materials=True,
                              generate_preview_surface=True, rename_uvmaps=True, relative_paths=True,
                              export_textures_mode="NEW", overwrite_textures=True, evaluation_mode="RENDER",
                              convert_world_material=True)
        return
    bpy.ops.export_scene.gltf(filepath=str(path), export_format=FORMATS[ending], collection=collection.name,
                              export_apply=True, export_lights=True, export_cameras=True, export_yup=True,
                              export_image_format="AUTO", export_extras=False, export_animations=False,
                              use_active_scene=True)


def _move(made: Path, path: Path) -> None:
    """Bring what was written to its place, the file itself last."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not (made / path.name).is_file() or not (made / path.name).stat().st_size:
            raise OSError(0, "Blender's exporter wrote nothing")
        for one in sorted(made.rglob("*"), key=lambda p: p.name == path.name):
            if one.is_file():
                target = path.parent / one.relative_to(made)
                target.parent.mkdir(parents=True, exist_ok=True)
                partial = target.with_name(f".partial-{target.name}")
                shutil.copyfile(one, partial)
                partial.replace(target)
    except OSError as error:
        raise StorageError(f"'{path}' can't be written ({error.strerror or error}); free some space or choose another "
                           "folder.") from error


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear Rec.709 to sRGB's transfer curve, clipped to 0...1 (IEC 61966-2-1)."""
    linear = np.clip(np.nan_to_num(linear), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
