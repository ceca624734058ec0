"""Some objects of a room fitted again under what the artist gives, and brought into the scene where they are."""

import shutil
from collections.abc import Generator, Iterable
from pathlib import Path

import bpy

from ...core.errors import MissingStageError
from ...core.results.room_file import material
from ..data.images import tiles_of
from ..data.materials import dress
from ..data.mesh_objects import is_open
from ..light import lamps
from ..marks import IMAGE, OBJECT_ID, RESULT, UV_MAP, mark
from ..refused import refused, sentences
from ..results import changes, file
from ..results import images as result_images
from ..scene.as_made import is_corrected, stamp_tree
from ..scene.write import BASE_COLOR
from . import corrections, unseen
from .material import worn_material

_WORN = ("model", "alpha", "f0", "emission", "transmission", "surfaces", "given")
"""Of an entry of materials.json, what its object's material is made of."""


def words(scene: bpy.types.Scene, things: Iterable[bpy.types.Object]) -> tuple[Path, list[str], dict[int, dict]]:
    """What has to be run: writes down what is given and finds all that it bears on.

    Parameters
    ----------
    things : iterable of bpy.types.Object
        At least these are fitted again; they are of one room.

    Returns
    -------
    folder : Path
        The result folder.
    words : list of str
        Of the command line.
    before : dict of int to dict
        The entries of materials.json as they are now.

    Raises
    ------
    BadInputError
        The result is gone, or they are of several.
    StorageError
        Its `overrides.json` can't be written.
    """
    things = list(things)
    folder = corrections.folder_for(things)
    numbers = corrections.keep(scene, folder) | {thing[OBJECT_ID] for thing in things}
    objects = [word for number in sorted(numbers) for word in ("--object", str(number))]
    return folder, ["refit", str(folder), *objects], corrections.made_by(folder)


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

    Only materials that the refit changed are made anew, so that what an artist did to others by hand stays.

    Parameters
    ----------
    folder : Path
        The result folder.
    after : result_file.Result
        What `words` and `fitted` gave.
    """
    things = [
        thing
        for thing in scene.objects
        if corrections.correctable(thing) and corrections.result_folder(thing) == folder
    ]
    image = _renew_images(folder)
    run, warnings, by_hand = after.run, [], []
    for done, thing in enumerate(things):
        yield done / max(len(things), 1)
        number = thing[OBJECT_ID]
        now = after.objects.get(number)
        mark(thing, folder, run)
        if now is not None and any(now.get(key) != before.get(number, {}).get(key) for key in _WORN):
            if is_corrected(worn_material(thing)):
                by_hand.append(thing.name)
                continue
            shown = (getattr(node, "image", None) for node in worn_material(thing).node_tree.nodes)
            _dress(thing, now, next((one for one in shown if one and UV_MAP in one), image))
            warnings += corrections.reapply(thing)
    for collection in scene.collection.children_recursive:
        if collection.get(RESULT) and Path(collection[RESULT]) == folder:
            mark(collection, folder, run)
            changes.store_findings(collection, changes.read_findings(folder))
    return (*warnings, *sentences((by_hand, "the material was edited by hand and stays")))


def _dress(thing: bpy.types.Object, entry: dict, image: bpy.types.Image | None) -> None:
    """Make an object's material anew in place; a lamp stays as bright as it was set."""
    worn = worn_material(thing)
    description, node = material(entry), unseen.texture_node(thing)
    if node is not None:
        image = unseen.source_of(node.image)
    state = lamps.snapshot(worn) if lamps.is_lamp(worn) else None
    if state is not None:
        lamps.restore(worn)
    dress(worn, description, image, one_sided=description.model.gives_light and is_open(thing.data))
    stamp_tree(worn, anew=True)
    if state is not None and description.model.gives_light:
        lamps.put_back(worn, state)


def _renew_images(folder: Path) -> bpy.types.Image | None:
    """Read the result's images again, whether they are referred to, packed or copies; the one of the room's colours."""
    found = None
    for one in bpy.data.images:
        if one.library or one.source not in ("FILE", "TILED"):
            continue
        shown = result_images.path_of(one)
        source = Path(one.get(IMAGE) or shown)
        if not source.is_relative_to(folder) or not result_images.is_there(source):
            continue
        if one.packed_file:
            one.unpack(method="REMOVE")
            one.filepath = str(source)
            one.reload()
            one.pack()
        else:
            for part in tiles_of(source) or [source]:
                if shown.is_relative_to(folder / result_images.KEPT):
                    result_images.link(part, shown.parent / part.name)
                elif shown != source:
                    target = shown.parent / part.name if part != source else shown
                    with refused(f"'{target}' can't be written", "free some space and refit again"):
                        shutil.copyfile(part, target)
            one.reload()
        one[IMAGE] = str(source)
        found = one if source.name == BASE_COLOR else found
    if found is None and (folder / BASE_COLOR).is_file():
        found = result_images.image(folder, BASE_COLOR)
    return found
