"""The room as glTF or USD, through Blender's own exporters."""

import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import BadInputError
from ..custom_properties import OBJECT_ID
from ..data.added import AddedData
from ..data.arrays import faces_of, layer_of
from ..data.materials import MODEL, opacity
from ..data.mesh_objects import PARTS_UV
from ..data.names import split_number
from ..refused import refused
from .material import plain_copy

FORMATS = {".glb": "GLB", ".gltf": "GLTF_SEPARATE", ".usdc": "USD", ".usd": "USD", ".usda": "USD", ".usdz": "USD"}
"""By ending."""
ROOM, SELECTED, ALL = "ROOM", "SELECTED", "ALL"
_BESIDE = (".usdc", ".usd", ".usda")
"""Formats whose textures we write beside the file ourselves."""
_COLLECTION = "Scan Relight export"
_USD = dict(export_materials=True, generate_preview_surface=True, rename_uvmaps=True, relative_paths=True)
_USD |= dict(overwrite_textures=True, evaluation_mode="RENDER", convert_world_material=True)
_GLTF = dict(export_apply=True, export_lights=True, export_cameras=True, export_yup=True, export_image_format="AUTO")
_GLTF |= dict(export_extras=False, export_animations=False, use_active_scene=True)
"""Settings of Blender's exporters."""


def can_export(ending: str) -> str:
    """'' where this Blender can write files of that ending, else one sentence."""
    if ending not in FORMATS:
        return f"Files ending in '{ending}' can't be written; choose .glb, .gltf, .usdc or .usdz."
    if FORMATS[ending] == "USD" and not bpy.app.build_options.usd:
        return "This Blender was built without USD; choose glTF."
    if FORMATS[ending] != "USD" and not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        return "Blender's glTF exporter is switched off; enable the add-on 'glTF 2.0 format' in the preferences."
    return ""


def export(
    scene: bpy.types.Scene, path: Path | str, scope: str = ROOM, lights: bool = True, cameras: bool = False
) -> list[str]:
    """Write a scene's objects with plain materials.

    Parameters
    ----------
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
    BadInputError, StorageError
        Nothing to export, or this Blender can't write the format; the file can't be written.
    """
    path = Path(path).absolute()
    ending = path.suffix.lower()
    problem = can_export(ending)
    if problem:
        raise BadInputError(problem)
    objects = chosen(scene, scope)
    if not objects:
        raise BadInputError("There is nothing to export: no visible mesh among what was chosen.")
    visible = (obj for obj in scene.objects if not obj.hide_render)
    extra = [obj for obj in visible if lights and obj.type == "LIGHT" or cameras and obj == scene.camera]
    with tempfile.TemporaryDirectory(prefix="scan_relight_", ignore_cleanup_errors=True) as folder:
        staging = Path(folder, "made")
        staging.mkdir()
        # Blender's USD exporter can be told no folder for its textures, but it can leave them where they are.
        textures = staging / textures_of(path) if ending in _BESIDE else Path(folder, "textures")
        with copies(scene, objects, extra, textures, FORMATS[ending] != "USD") as collection:
            with refused(f"'{path}' can't be exported", "choose another format, or fewer objects"):
                _write(staging / path.name, ending, collection)
        with refused(f"'{path}' can't be written", "free some space or choose another folder"):
            put(staging, path)
    return remarks(ending, objects, extra, scene)


def chosen(scene: bpy.types.Scene, scope: str) -> list[bpy.types.Object]:
    """The meshes in a scope, except those hidden from renders."""
    meshes = [obj for obj in scene.objects if obj.type == "MESH" and not obj.hide_render]
    if scope == SELECTED:
        return [obj for obj in meshes if obj.select_get()]
    if scope == ROOM:
        return [obj for obj in meshes if OBJECT_ID in obj or "scan_relight_virtual" in obj]
    return meshes


def remarks(
    ending: str, objects: Iterable[bpy.types.Object], lamps: Iterable[bpy.types.Object], scene: bpy.types.Scene
) -> list[str]:
    """What a format can't hold of these objects, one sentence each."""
    messages = []
    if FORMATS[ending] == "USD":
        messages.append(
            "USD's preview surface has no one-sided emission and Blender writes no Specular IOR Level to it: "
            "objects without highlight get an index of refraction of 1 instead."
        )
        if any(opacity(slot.material) < 0.99 for obj in objects for slot in obj.material_slots if slot.material):
            messages.append("Blender 5.2 writes no Alpha to USD, so glass may be opaque there; glTF keeps it.")
    else:
        if any(lamp.type == "LIGHT" and lamp.data.type == "AREA" for lamp in lamps):
            messages.append("glTF has no area lights, so they are left out.")
        if scene.world is not None and scene.world.node_tree:
            messages.append(
                "glTF holds no light from outside, and few viewers light a room by its glowing lamps: add the "
                "light there."
            )
    return messages


@contextmanager
def copies(
    scene: bpy.types.Scene,
    objects: Iterable[bpy.types.Object],
    extra: Iterable[bpy.types.Object],
    textures: Path,
    level: bool = True,
) -> Iterator[bpy.types.Collection]:
    """A temporary collection of copies with plain materials, their 8-bit pictures in `textures`."""
    world, names, added = scene.world, Names(), AddedData()
    try:
        textures.mkdir(parents=True)
        collection = bpy.data.collections.new(_COLLECTION)
        scene.collection.children.link(collection)
        pictures: dict = {}
        plain_materials: dict = {}
        objects, extra = list(objects), list(extra)
        for obj, name in zip(objects + extra, unique(own_name(obj) for obj in objects + extra)):
            copy = obj.copy()
            names.give("objects", copy, name)
            collection.objects.link(copy)
            copy.parent = None
            copy.matrix_world = obj.matrix_world
            if obj not in objects:
                continue
            copy.hide_viewport = False
            for old_slot, slot in zip(obj.material_slots, copy.material_slots):
                if old_slot.material is None:
                    continue
                if old_slot.material not in plain_materials:
                    copied = plain_copy(old_slot.material, textures, pictures, level, _tiles(obj))
                    plain_materials[old_slot.material] = copied
                slot.link = "OBJECT"
                slot.material = plain_materials[old_slot.material]
        for material, name in zip(plain_materials, unique(map(own_name, plain_materials))):
            names.give("materials", plain_materials[material], name)
        # By their first objects: several may share one mesh.
        meshes = {copy.data: copy for copy in reversed(collection.objects) if copy.type == "MESH"}
        mesh_names = [copy.name if OBJECT_ID in copy else mesh.name for mesh, copy in meshes.items()]
        for mesh, name in zip(meshes, unique(mesh_names)):
            names.give("meshes", mesh, name)
        if not level and world is not None and world.node_tree:
            scene.world = _with_own_pictures(world, textures)
        yield collection
    finally:
        scene.world = world
        added.remove()
        names.put_back()


def _tiles(obj: bpy.types.Object) -> frozenset[int]:
    """The UDIM tiles that an object's faces lie on; none where it has no coordinates for tiles."""
    layer = obj.data.uv_layers.get(PARTS_UV)
    if layer is None or not len(layer.uv):
        return frozenset()
    # By the middles of faces: a corner may lie on an edge.
    starts, uv = faces_of(obj.data)[0], layer_of(obj.data, PARTS_UV)
    middle = np.add.reduceat(uv, starts[:-1]) / np.diff(starts)[:, None]
    column, row = np.floor(middle).astype(int).T
    return frozenset((1001 + column + 10 * row).tolist())


def _with_own_pictures(world: bpy.types.World, textures: Path) -> bpy.types.World:
    copy = world.copy()
    for node in copy.node_tree.nodes:
        image = node.image if node.type == "TEX_ENVIRONMENT" else None
        if image is None or not (image.packed_file or image.source == "FILE"):
            continue
        source = Path(bpy.path.abspath(image.filepath))
        path = textures / f"{bpy.path.clean_name(image.name)}{source.suffix}"
        if image.packed_file:
            path.write_bytes(image.packed_file.data)
        elif source.is_file():
            shutil.copyfile(source, path)
        else:
            continue
        node.image = bpy.data.images.load(str(path))
        node.image.colorspace_settings.name = image.colorspace_settings.name
    return copy


def _write(path: Path, ending: str, collection: bpy.types.Collection) -> None:
    if FORMATS[ending] == "USD":
        settings = _USD | {"export_textures_mode": "KEEP" if ending in _BESIDE else "NEW"}
        bpy.ops.wm.usd_export(filepath=str(path), collection=collection.name, **settings)
    else:
        settings = _GLTF | {"export_format": FORMATS[ending], "export_texture_dir": textures_of(path)}
        bpy.ops.export_scene.gltf(filepath=str(path), collection=collection.name, **settings)


def textures_of(path: Path) -> str:
    """Name of the folder for a file's pictures, beside it; unique even if another file has the same stem or ending."""
    return f"{path.name} textures"


def put(staging: Path, path: Path) -> None:
    """Move what was written into the folder `staging` to its place beside `path`, `path` itself last.

    An earlier export of that file is replaced with its textures, nothing else is touched; all is back where it fails
    (`OSError`).
    """
    if not (staging / path.name).is_file() or not (staging / path.name).stat().st_size:
        raise OSError(0, "Blender's exporter wrote nothing")
    path.parent.mkdir(parents=True, exist_ok=True)
    written = {entry.name for entry in staging.iterdir()}
    names = sorted(written | {textures_of(path)}, key=lambda name: name == path.name)
    partial, backup = ({name: path.parent / f".{kind}-{name}" for name in names} for kind in ("partial", "before"))
    done = []
    try:
        for name in names:
            _remove(partial[name], backup[name])
            if (staging / name).is_dir() and any((staging / name).iterdir()):
                shutil.copytree(staging / name, partial[name])
            elif (staging / name).is_file():
                shutil.copyfile(staging / name, partial[name])
        for name in names:
            if (path.parent / name).exists():
                (path.parent / name).replace(backup[name])
            done.append(name)
            if partial[name].exists():
                partial[name].replace(path.parent / name)
    except OSError:
        with suppress(OSError):
            for name in reversed(done):
                _remove(path.parent / name)
                if backup[name].exists():
                    backup[name].replace(path.parent / name)
        raise
    finally:
        _remove(*partial.values())
    _remove(*backup.values())


def _remove(*paths: Path) -> None:
    for path in paths:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


_ASIDE = "Scan Relight keeps "


def identifier(name: str) -> str:
    """A name as USD writes it: letters, digits and underscores, no digit first."""
    legal = re.sub(r"\W", "_", name)
    return f"_{legal}" if legal[:1].isdigit() else legal


def own_name(datablock: bpy.types.ID) -> str:
    """An object's or material's name; of a recovered one without the '.001' that Blender adds to the second room's."""
    return split_number(datablock.name)[0] if OBJECT_ID in datablock or MODEL in datablock else datablock.name


def unique(names: Iterable[str]) -> list[str]:
    """The names, repeated ones with a number appended: distinct in USD and on any file system."""
    taken, result = set(), []
    for name in names:
        candidate, number = name, 1
        while identifier(candidate).casefold() in taken:
            number += 1
            candidate = f"{name} ({number})"
        taken.add(identifier(candidate).casefold())
        result.append(candidate)
    return result


class Names:
    """Temporary names of datablocks, and the names to restore."""

    def __init__(self) -> None:
        self._before: list[tuple[bpy.types.ID, str]] = []

    def give(self, kind: str, item: bpy.types.ID, name: str) -> None:
        """Rename `item` of ``bpy.data``'s collection `kind` to `name`; linked data keep theirs."""
        if item.library or item.name == name:
            return
        datablocks = getattr(bpy.data, kind)
        bearer = datablocks.get((name, None))
        if bearer is not None:
            self._rename(bearer, f"{_ASIDE}{len(self._before)}")
        self._rename(item, name)

    def _rename(self, item: bpy.types.ID, name: str) -> None:
        self._before.append((item, item.name))
        item.name = name

    def put_back(self) -> None:
        """Restore all names; the copies have to be removed before."""
        for item, name in reversed(self._before):
            with suppress(ReferenceError):  # a copy, gone by now
                item.name = name
