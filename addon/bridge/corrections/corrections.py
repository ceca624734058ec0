"""What the artist says of recovered objects: kept with them, shown at once, written beside the result for a refit.

An object's property `custom_properties.GIVEN` holds it, so that it is saved and undone with the scene; a part's has the
part's number (`data.instances.key_of`). Functions that take `object_id` are about that instance of the object, by
default about that of its active material slot. The result folder's `overrides.json`, which runs heed, is brought in
line with the scene whenever a run or refit begins (`keep`).
"""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import bpy

from ...core.atomic import write_bytes
from ...core.brdf.dielectric import DIELECTRIC
from ...core.brdf.registry import find_or_lambertian
from ...core.errors import BadInputError
from ...core.kinds import Shown
from ...core.results.overrides import LOBE, OVERRIDES, Given, Overrides, White, kept_overrides, merge, parse
from ...core.results.result_folders import write_capture
from ..custom_properties import CAPTURE, FOUND, GIVEN, OBJECT_ID, RESULT, SMOOTH, WHITE
from ..data.instances import chosen_in, key_of, name_of, slots_of
from ..results import file, look
from ..scene.as_made import is_corrected, our_own
from . import material, unseen
from .material import entry
from .smooth import shade
from .unseen import room_of

ROUGHNESS: Shown[float] = 0.3
"""Shown until a refit, where nothing better is known."""

_written: dict[Path, set[int | str]] = {}
"""Objects, by result folder, whose entries in its overrides.json come from this session's scenes: undo reaches them."""


def correctable(obj: bpy.types.Object | None, object_id: int | None = None) -> bool:
    """Whether an object wears a recovered material that can be changed."""
    if obj is None or obj.type != "MESH" or OBJECT_ID not in obj or obj.library:
        return False
    return material.worn_material(obj, object_id) is not None


def result_folder(obj: bpy.types.Object) -> Path | None:
    """The result folder that an object came from; None where it is gone."""
    folder = Path(obj[RESULT]) if obj.get(RESULT) else None
    result = file.read(folder) if folder else None
    return folder if result is not None and result.objects else None


def made_by(folder: Path) -> dict[int, dict[str, Any]]:
    """The entries of a result folder's materials.json, by `object_id`; {} for none."""
    result = file.read(folder)
    return dict(result.objects) if result else {}


def given(obj: bpy.types.Object, object_id: int | None = None) -> dict[str, Any]:
    """What is given of an object: by the artist here, else by the overrides that its run was made with."""
    key = key_of(GIVEN, obj, object_id)
    if key not in obj:
        return dict(entry(obj, object_id).get("given") or {})
    try:
        value = json.loads(obj[key])
    except (TypeError, ValueError):
        return {}
    return value if isinstance(value, dict) else {}


def give(obj: bpy.types.Object, object_id: int | None = None, **values) -> None:
    """Override values of a `correctable` object's material and show the result.

    Parameters
    ----------
    **values
        As in an override: `model`, `roughness`, `f0`, `base_color`, `same_as`; None removes one. Earlier values that
        contradict them go (`core.results.overrides.merge`).

    Raises
    ------
    BadInputError
        A value is impossible, or `same_as` would form a circle.
    """
    object_id = chosen_in(obj) if object_id is None else object_id
    room = instances_in(room_of(obj))
    content = {"objects": {str(object_id): {key: _plain(value) for key, value in values.items()}}}
    newer = parse(content, f"Object '{name_of(obj, object_id)}'", room)
    room[object_id] = obj
    older = {i: _given(member, i) for i, member in room.items() if i == object_id or _is_given(member, i)}
    override = merge(Overrides(older), newer).of(object_id).as_dict()
    material.note(obj, object_id)
    obj[key_of(GIVEN, obj, object_id)] = json.dumps(override)
    show(obj, object_id)
    others = ((other, i) for other in room_of(obj) for i in slots_of(other) if (other, i) != (obj, object_id))
    for other, i in others:
        if _is_given(other, i) and given(other, i).get("same_as") == object_id:
            show(other, i)


def take_back(obj: bpy.types.Object, *keys: str) -> None:
    """Go back to what was found, for `keys` or in everything."""
    give(obj, **dict.fromkeys(keys or tuple(given(obj)), None))


def instances_in(objects: Iterable[bpy.types.Object]) -> dict[int, bpy.types.Object]:
    """The object that shows each instance."""
    return {object_id: obj for obj in objects for object_id in slots_of(obj)}


def _plain(value):
    """Numbers for JSON, clamped to 0...1; all else unchanged."""
    if isinstance(value, (str, int)) or value is None:
        return value
    return [_plain(item) for item in value] if hasattr(value, "__len__") else round(min(max(float(value), 0.0), 1.0), 6)


def _given(obj: bpy.types.Object, object_id: int) -> Given:
    override = given(obj, object_id)
    return Given(**{key: tuple(value) if isinstance(value, list) else value for key, value in override.items()})


def _is_given(obj: bpy.types.Object, object_id: int) -> bool:
    """Whether the scene says of an instance what is given of it, and be it nothing."""
    return key_of(GIVEN, obj, object_id) in obj


def carry(before: dict[int, bpy.types.Object], after: dict[int, bpy.types.Object]) -> None:
    """Move what is given of instances to the objects that show them now, both as `instances_in` gives them."""
    for object_id in before.keys() & after.keys():
        old, new = before[object_id], after[object_id]
        for name in (GIVEN, FOUND, WHITE) if old != new else ():
            if (value := old.pop(key_of(name, old, object_id), None)) is not None:
                new[key_of(name, new, object_id)] = value


def by_id(obj: bpy.types.Object, object_id: int) -> bpy.types.Object | None:
    """The object of the same room that shows another instance."""
    members = (other for other in room_of(obj) if object_id in slots_of(other))
    return next((other for other in members if correctable(other, object_id)), None)


def effective(obj: bpy.types.Object, object_id: int | None = None, visited: frozenset = frozenset()) -> dict[str, Any]:
    """The values recovered of an object (`material.recovered_values`), overridden by those given."""
    object_id = chosen_in(obj) if object_id is None else object_id
    override = given(obj, object_id)
    like = override.get("same_as")
    source = by_id(obj, like) if like is not None else None
    copied = {}
    if source is not None and like not in visited:
        copied = effective(source, like, visited | {object_id})
        copied = {key: copied[key] for key in LOBE}
    values = _base_values(obj, object_id, override, (override | copied).get("model"))
    previous_model = values["model"]
    values |= copied
    values |= {key: override[key] for key in (*LOBE, "base_color") if key in override}
    model = find_or_lambertian(values["model"])
    if "model" not in override and {"f0", "roughness"} & override.keys() and model.has_albedo and not model.has_lobe:
        model = DIELECTRIC
        values["model"] = model.name
    if model.lobe_alone and "base_color" in override and "f0" not in override:
        values["f0"] = override["base_color"]
    if model.has_lobe:
        if values["roughness"] is None:
            values["roughness"] = ROUGHNESS
        new_model = values["model"] != previous_model and source is None and not {"f0", "base_color"} & override.keys()
        if values["f0"] is None or new_model:
            values["f0"] = model.plausible_f0(values["base_color"])
        f0 = model.as_f0(values["f0"])
        values["f0"] = list(f0) if isinstance(f0, tuple) else f0
    return values


def _base_values(obj: bpy.types.Object, object_id: int, override: dict, model: str | None) -> dict[str, Any]:
    """The values that an override replaces: fitted by the run to that model, else found before one was given."""
    original, worn = material.recovered_values(obj, object_id), material.worn(obj, object_id)
    if worn["model"] != (model or original["model"]):
        return original
    # What was given to the run, and is not any more.
    withdrawn = (entry(obj, object_id).get("given") or {}).keys() - override.keys()
    return worn | {key: original[key] for key in worn if key in withdrawn or ("same_as" in withdrawn and key in LOBE)}


def show(obj: bpy.types.Object, object_id: int | None = None) -> None:
    """Update an object's material to what is given."""
    object_id = chosen_in(obj) if object_id is None else object_id
    if correctable(obj, object_id):
        with our_own(material.worn_material(obj, object_id)):
            material.show(obj, object_id, effective(obj, object_id))
        if not given(obj, object_id) and material.recovered_values(obj, object_id) == material.worn(obj, object_id):
            obj.pop(key_of(FOUND, obj, object_id), None)


def reapply(obj: bpy.types.Object) -> list[str]:
    """Restore what the artist did to an object whose mesh or material a run has just made anew.

    Its corrected values, its painted image, its smooth shading. Returns warnings on what no longer fits.
    """
    if obj.type == "MESH" and SMOOTH in obj and not obj.data.library:
        shade(obj.data, obj[SMOOTH])
    worn = {i: material.worn_material(obj, i) for i in slots_of(obj) if correctable(obj, i)}
    made = [object_id for object_id, recovered in worn.items() if not is_corrected(recovered)]
    for object_id in made:
        material.renew(obj, object_id, given(obj, object_id))
    messages = unseen.reapply(obj) if made else []
    for object_id in made:
        show(obj, object_id)
    return messages


def say_white(obj: bpy.types.Object, albedo) -> None:
    """Give an object's albedo (one number or three, 0...1), in place of any other given in its room."""
    value = _plain(albedo if hasattr(albedo, "__len__") else [float(albedo)] * 3)
    take_white_back(obj)
    obj[key_of(WHITE, obj)] = value


def white_of(obj: bpy.types.Object) -> tuple[bpy.types.Object, int, list[float]] | None:
    """The object of a room whose albedo is given, which instance of it, and that albedo; None where none is."""
    return next(_whites(room_of(obj)), None)


def _whites(objects: Iterable[bpy.types.Object]) -> Iterator[tuple[bpy.types.Object, int, list[float]]]:
    for obj in objects:
        for object_id in slots_of(obj):
            if (key := key_of(WHITE, obj, object_id)) in obj:
                yield obj, object_id, list(obj[key])


def take_white_back(obj: bpy.types.Object) -> None:
    """Have the room's scale follow from the frames alone again."""
    for other, object_id, _ in list(_whites(room_of(obj))):
        del other[key_of(WHITE, other, object_id)]


def folder_for(objects: Iterable[bpy.types.Object]) -> Path:
    """The one result folder of `objects`; raises `BadInputError` where there are several, or none any more."""
    folders = {result_folder(obj) for obj in objects}
    if len(folders) != 1:
        raise BadInputError("The selected objects come from several results; select those of one room.")
    folder = folders.pop()
    if folder is None:
        raise BadInputError(
            "The result folder of the selected objects is gone; choose where it lies now, or run the recovery again."
        )
    return folder


def keep_for_run(scene: bpy.types.Scene, folder: Path, capture: Path) -> None:
    """`keep` before a capture is run into `folder`, which may be another one than the scene's room came from."""
    rooms = [collection for collection in bpy.data.collections if collection.get(CAPTURE) == str(capture)]
    room = {obj for collection in rooms for obj in collection.all_objects}
    room |= {obj for obj in scene.objects if obj.get(CAPTURE) == str(capture)}
    objects = [obj for obj in look.recovered(scene) if obj in room or result_folder(obj) == folder]
    if any(key.startswith((GIVEN, WHITE)) for obj in objects for key in obj.keys()) or _written.get(folder):
        if not folder.exists():
            folder.mkdir(parents=True)
            write_capture(folder, capture)  # from the first file on it is that capture's
        keep(scene, folder, objects)


def keep(scene: bpy.types.Scene, folder: Path, objects: Iterable[bpy.types.Object] | None = None) -> set[int]:
    """Bring a result's `overrides.json` in line with what is given in a scene.

    Entries of objects of which the scene says nothing are left alone, unless it was this session that wrote them: then
    the artist has taken them back by undo. `objects` are the room's objects, by default those of that result.

    Returns
    -------
    set of int
        Objects whose entry is not what the result's materials were made with: a refit has to do them.

    Raises
    ------
    BadInputError, StorageError
        The file is damaged, or can't be written.
    """
    if objects is None:
        objects = [obj for obj in look.recovered(scene) if result_folder(obj) == folder]
    scene_entries = {i: _given(obj, i) for obj in objects for i in slots_of(obj) if _is_given(obj, i)}
    result = made_by(folder)
    stored = kept_overrides(folder, {*result, *instances_in(objects)})
    written = _written.setdefault(folder, set())
    entries = {i: override for i, override in stored.objects.items() if i not in written} | scene_entries
    white = stored.white if "white" not in written else None
    white_here = next(_whites(objects), None)
    if white_here is not None:
        white = White(white_here[1], tuple(white_here[2]))
    updated = Overrides({i: override for i, override in entries.items() if override.any}, white)
    if updated.as_dict() != stored.as_dict():
        write_bytes(folder / OVERRIDES, json.dumps(updated.as_dict(), indent=1).encode())
    written |= scene_entries.keys() | ({"white"} if white_here is not None else set())
    return {i for i, override in result.items() if updated.of(i).as_dict() != (override.get("given") or {})}


def forget() -> None:
    """Forget what was written in this session."""
    _written.clear()
