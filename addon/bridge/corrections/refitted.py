"""Objects of a room fitted again under the artist's overrides, and updated in the scene."""

import shutil
from collections.abc import Generator, Iterable
from pathlib import Path

import bpy

from ...core.errors import MissingStageError
from ...core.results.room_file import material
from ..custom_properties import IMAGE, RESULT, UV_MAP, set_run
from ..data.images import tiles_of
from ..data.instances import chosen_in, name_of, slots_of
from ..data.materials import dress, shines_to_the_front
from ..data.mesh_objects import is_one_sided
from ..light import lamps
from ..refused import refused, sentences
from ..results import changes, file
from ..results import images as result_images
from ..scene.as_made import is_corrected, stamp_tree
from ..scene.write import BASE_COLOR
from . import corrections, unseen
from .material import worn_material

_MATERIAL_KEYS = ("model", "alpha", "f0", "emission", "transmission", "surfaces", "given")
"""Keys of an entry of materials.json that its object's material is made of."""


def words(scene: bpy.types.Scene, objects: Iterable[bpy.types.Object]) -> tuple[Path, list[str], dict[int, dict]]:
    """The command to run: writes the overrides and finds all objects that they affect.

    Parameters
    ----------
    objects : iterable of bpy.types.Object
        At least these are fitted again, each by what its active material slot shows; they are of one room.

    Returns
    -------
    Path, list of str, dict of int to dict
        The result folder, words of the command line, and the entries of materials.json as they are now.

    Raises
    ------
    BadInputError, StorageError
        The result is gone, or they are of several; its `overrides.json` can't be written.
    """
    objects = list(objects)
    folder = corrections.folder_for(objects)
    object_ids = corrections.keep(scene, folder) | {chosen_in(obj) for obj in objects}
    options = [word for object_id in sorted(object_ids) for word in ("--object", str(object_id))]
    return folder, ["refit", str(folder), *options], corrections.made_by(folder)


def fitted(folder: Path) -> file.Result:
    """What the refit left; raises `MissingStageError` where it left nothing."""
    result = file.read(folder)
    if result is None or not result.objects:
        raise MissingStageError(f"'{folder / file.MATERIALS}' is missing or damaged; run the recovery again.")
    return result


def bringing(
    scene: bpy.types.Scene, folder: Path, before: dict[int, dict], after: file.Result
) -> Generator[float, None, tuple[str, ...]]:
    """Put onto a scene's objects what a refit changed; yields the share done, returns warnings.

    Only materials that the refit changed are made anew, so that what an artist did to others by hand stays. `folder`
    and `before` are what `words` gave, `after` what `fitted` gave.
    """
    recovered = (obj for obj in scene.objects if any(corrections.correctable(obj, i) for i in slots_of(obj)))
    objects = [obj for obj in recovered if corrections.result_folder(obj) == folder]
    image = _renew_images(folder)
    run, warnings, edited = after.run, [], []
    for done, obj in enumerate(objects):
        yield done / max(len(objects), 1)
        set_run(obj, folder, run)
        changed = False
        for object_id in slots_of(obj):
            entry, worn = after.objects.get(object_id), worn_material(obj, object_id)
            earlier = before.get(object_id, {})
            if entry is None or worn is None or all(entry.get(key) == earlier.get(key) for key in _MATERIAL_KEYS):
                continue
            if is_corrected(worn):
                edited.append(name_of(obj, object_id))
                continue
            node_images = (getattr(node, "image", None) for node in worn.node_tree.nodes)
            texture = next((texture for texture in node_images if texture and UV_MAP in texture), image)
            _dress(obj, object_id, entry, texture)
            changed = True
        warnings += corrections.reapply(obj) if changed else []
    for collection in scene.collection.children_recursive:
        if collection.get(RESULT) and Path(collection[RESULT]) == folder:
            set_run(collection, folder, run)
            changes.store_findings(collection, changes.read_findings(folder))
    return (*warnings, *sentences((edited, "the material was edited by hand and stays")))


def _dress(obj: bpy.types.Object, object_id: int, entry: dict, image: bpy.types.Image | None) -> None:
    """Make an instance's material anew in place; a lamp stays as bright as it was set."""
    worn = worn_material(obj, object_id)
    description, node = material(entry), unseen.texture_node(obj, object_id)
    if node is not None:
        image = unseen.source_of(node.image)
    state = lamps.snapshot(worn) if lamps.is_lamp(worn) else None
    if state is not None:
        lamps.restore(worn)
    one_sided = shines_to_the_front(worn) if state is not None else is_one_sided(obj.data, False)
    dress(worn, description, image, one_sided=description.model.gives_light and one_sided)
    stamp_tree(worn, anew=True)
    if state is not None and description.model.gives_light:
        lamps.put_back(worn, state)


def _renew_images(folder: Path) -> bpy.types.Image | None:
    """Reload the result's images, whether linked, packed or copied; returns the room's Base Color."""
    base_color = None
    for image in bpy.data.images:
        if image.library or image.source not in ("FILE", "TILED"):
            continue
        path = result_images.path_of(image)
        source = Path(image.get(IMAGE) or path)
        if not source.is_relative_to(folder) or not result_images.is_there(source):
            continue
        if image.packed_file:
            image.unpack(method="REMOVE")
            image.filepath = str(source)
            image.reload()
            image.pack()
        else:
            for tile in tiles_of(source) or [source]:
                if path.is_relative_to(folder / result_images.KEPT):
                    result_images.link(tile, path.parent / tile.name)
                elif path != source:
                    target = path.parent / tile.name if tile != source else path
                    with refused(f"'{target}' can't be written", "free some space and refit again"):
                        shutil.copyfile(tile, target)
            image.reload()
        image[IMAGE] = str(source)
        base_color = image if source.name == BASE_COLOR else base_color
    if base_color is None and (folder / BASE_COLOR).is_file():
        base_color = result_images.image(folder, BASE_COLOR)
    return base_color
