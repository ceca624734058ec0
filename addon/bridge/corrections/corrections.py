"""What the artist says of recovered objects: kept with them, shown at once, written beside the result for a refit.

An object's property `marks.GIVEN` holds it, so that it is saved and undone with the scene. The result folder's
`overrides.json`, which runs heed, is brought in line with the scene whenever a run or refit begins (`keep`).
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import bpy

from ...core.atomic import write_bytes
from ...core.brdf.dielectric import DIELECTRIC
from ...core.brdf.registry import shown
from ...core.errors import BadInputError
from ...core.kinds import Shown
from ...core.results.overrides import LOBE, OVERRIDES, Given, Overrides, White, kept_overrides, merge, parse
from ...core.results.place import write_capture
from ..marks import CAPTURE, FOUND, GIVEN, OBJECT_ID, RESULT, SMOOTH, WHITE
from ..results import file, look
from ..scene.as_made import is_corrected, our_own
from . import material, unseen
from .material import entry
from .unseen import room_of

ROUGHNESS: Shown[float] = 0.3
"""What is shown until a refit, where nothing better is known."""

_written: dict[Path, set[int | str]] = {}
"""Objects, by result folder, whose entries in its overrides.json come from this session's scenes: undo reaches them."""


def correctable(thing: bpy.types.Object | None) -> bool:
    """Whether an object wears a recovered material that can be changed."""
    return (
        thing is not None
        and thing.type == "MESH"
        and OBJECT_ID in thing
        and not thing.library
        and material.worn_material(thing) is not None
    )


def result_folder(thing: bpy.types.Object) -> Path | None:
    """The result folder that an object came from; None where it is gone."""
    folder = Path(thing[RESULT]) if thing.get(RESULT) else None
    result = file.read(folder) if folder else None
    return folder if result is not None and result.objects else None


def made_by(folder: Path) -> dict[int, dict[str, Any]]:
    """The objects of the run that lies in a result folder, as materials.json tells them, by number; {} for none."""
    result = file.read(folder)
    return dict(result.objects) if result else {}


def given(thing: bpy.types.Object) -> dict[str, Any]:
    """What is given of an object: by the artist here, else by the overrides that its run was made with."""
    if GIVEN not in thing:
        return dict(entry(thing).get("given") or {})
    try:
        value = json.loads(thing[GIVEN])
    except (TypeError, ValueError):
        return {}
    return value if isinstance(value, dict) else {}


def give(thing: bpy.types.Object, **values) -> None:
    """Say something of an object's material and show it.

    Parameters
    ----------
    thing : bpy.types.Object
        `correctable`.
    **values
        As in an override: `model`, `roughness`, `f0`, `base_color`, `same_as`; None takes one back. What contradicts
        them and was given before goes (`core.results.overrides.merge`).

    Raises
    ------
    BadInputError
        A value can't be, or objects would be the same as each other in a circle.
    """
    number = thing[OBJECT_ID]
    room = {one[OBJECT_ID]: one for one in room_of(thing)}
    newer = parse(
        {"objects": {str(number): {key: _plain(value) for key, value in values.items()}}},
        f"Object '{thing.name}'",
        room,
    )
    older = {i: Given(**_tuples(given(one))) for i, one in room.items() if i == number or GIVEN in one}
    said = merge(Overrides(older), newer).of(number).as_dict()
    material.note(thing)
    thing[GIVEN] = json.dumps(said)
    show(thing)
    for other in room_of(thing):
        if other != thing and GIVEN in other and given(other).get("same_as") == number:
            show(other)


def take_back(thing: bpy.types.Object, *keys: str) -> None:
    """Go back to what was found, for `keys` or in everything."""
    give(thing, **dict.fromkeys(keys or tuple(given(thing)), None))


def _plain(value):
    """Numbers as JSON has them, within 0...1; all else as it is."""
    if isinstance(value, (str, int)) or value is None:
        return value
    return [_plain(one) for one in value] if hasattr(value, "__len__") else round(min(max(float(value), 0.0), 1.0), 6)


def _tuples(said: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in said.items()}


def by_id(thing: bpy.types.Object, number: int) -> bpy.types.Object | None:
    """Another object of the same room."""
    return next((one for one in room_of(thing) if one[OBJECT_ID] == number and correctable(one)), None)


def effective(thing: bpy.types.Object, seen: frozenset = frozenset()) -> dict[str, Any]:
    """What was found of an object (`material.found`) with what is given laid over it."""
    said = given(thing)
    other = by_id(thing, said["same_as"]) if said.get("same_as") is not None else None
    theirs = {}
    if other is not None and other.name not in seen:
        theirs = effective(other, seen | {thing.name})
        theirs = {key: theirs[key] for key in LOBE}
    values = _under(thing, said, (said | theirs).get("model"))
    before = values["model"]
    values |= theirs
    values |= {key: said[key] for key in (*LOBE, "base_color") if key in said}
    model = shown(values["model"])
    if "model" not in said and {"f0", "roughness"} & said.keys() and model.has_albedo and not model.has_lobe:
        model = DIELECTRIC
        values["model"] = model.name
    if model.lobe_alone and "base_color" in said and "f0" not in said:
        values["f0"] = said["base_color"]
    if model.has_lobe:
        if values["roughness"] is None:
            values["roughness"] = ROUGHNESS
        new_model = values["model"] != before and other is None and not {"f0", "base_color"} & said.keys()
        if values["f0"] is None or new_model:
            values["f0"] = model.plausible_f0(values["base_color"])
        f0 = model.as_f0(values["f0"])
        values["f0"] = list(f0) if isinstance(f0, tuple) else f0
    return values


def _under(thing: bpy.types.Object, said: dict, model: str | None) -> dict[str, Any]:
    """What to lay given values over: what the run fitted to that model, else what was found before it was given one."""
    was, made = material.found(thing), material.worn(thing)
    if made["model"] != (model or was["model"]):
        return was
    back = (entry(thing).get("given") or {}).keys() - said.keys()  # given to the run, and not any more
    return made | {key: was[key] for key in made if key in back or ("same_as" in back and key in LOBE)}


def show(thing: bpy.types.Object) -> None:
    """Bring an object's material in line with what is given."""
    if correctable(thing):
        with our_own(material.worn_material(thing)):
            material.show(thing, effective(thing))
        if not given(thing) and material.found(thing) == material.worn(thing):
            thing.pop(FOUND, None)


def reapply(thing: bpy.types.Object) -> list[str]:
    """Bring back what the artist did to an object whose mesh or material a run has just made anew.

    Its corrected values, its painted image, its smooth shading. For whoever updates a room, at the end of each object.
    Returns sentences on what no longer fits.
    """
    if thing.type == "MESH" and SMOOTH in thing and not thing.data.library:
        _shade(thing.data, thing[SMOOTH])
    if not correctable(thing) or is_corrected(material.worn_material(thing)):
        return []
    material.renew(thing, given(thing))
    said = unseen.reapply(thing)
    show(thing)
    return said


def smooth(things: Iterable[bpy.types.Object], angle: float) -> int:
    """Shade objects smooth but for edges sharper than `angle` radians; 0 makes them flat again.

    The scan's geometric normals are what the light was divided by; smoothing changes how it is shown, not what was
    found. Returns how many meshes were changed.
    """
    changed = set()
    for thing in things:
        if angle > 0:
            thing[SMOOTH] = float(angle)
        elif SMOOTH in thing:
            del thing[SMOOTH]
        if thing.data not in changed:
            _shade(thing.data, angle)
            changed.add(thing.data)
    return len(changed)


def _shade(data: bpy.types.Mesh, angle: float) -> None:
    if angle > 0:
        data.shade_smooth()
        data.set_sharp_from_angle(angle=angle)
    else:
        if "sharp_edge" in data.attributes:
            data.attributes.remove(data.attributes["sharp_edge"])
        data.shade_flat()
    data.update()


def say_white(thing: bpy.types.Object, albedo) -> None:
    """Say what albedo an object has (number or three, 0...1), in place of any other of its room."""
    value = _plain(albedo if hasattr(albedo, "__len__") else [float(albedo)] * 3)
    take_white_back(thing)
    thing[WHITE] = value


def white_of(thing: bpy.types.Object) -> tuple[bpy.types.Object, list[float]] | None:
    """The object of a room whose albedo is given, and that albedo; None where none is."""
    return next(((one, list(one[WHITE])) for one in room_of(thing) if WHITE in one), None)


def take_white_back(thing: bpy.types.Object) -> None:
    """Let the frames alone say the room's scale again."""
    for other in room_of(thing):
        other.pop(WHITE, None)


def folder_for(things: Iterable[bpy.types.Object]) -> Path:
    """The one result folder of `things`; raises `BadInputError` where there are several, or none any more."""
    folders = {result_folder(thing) for thing in things}
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
    room = {thing for part in bpy.data.collections if part.get(CAPTURE) == str(capture) for thing in part.all_objects}
    things = [
        thing
        for thing in look.recovered(scene)
        if result_folder(thing) == folder or thing.get(CAPTURE) == str(capture) or thing in room
    ]
    if any(GIVEN in thing or WHITE in thing for thing in things) or _written.get(folder):
        if not folder.exists():
            folder.mkdir(parents=True)
            write_capture(folder, capture)  # from the first file on it is that capture's
        keep(scene, folder, things)


def keep(scene: bpy.types.Scene, folder: Path, things: Iterable[bpy.types.Object] | None = None) -> set[int]:
    """Bring a result's `overrides.json` in line with what is given in a scene.

    Entries of objects of which the scene says nothing are left alone, unless it was this session that wrote them: then
    the artist has taken them back by undo. `things` are the room's objects, by default those of that result.

    Returns
    -------
    set of int
        Objects whose entry is not what the result's materials were made with: a refit has to do them.

    Raises
    ------
    BadInputError
        The file is damaged.
    StorageError
        It can't be written.
    """
    if things is None:
        things = [thing for thing in look.recovered(scene) if result_folder(thing) == folder]
    said = {thing[OBJECT_ID]: Given(**_tuples(given(thing))) for thing in things if GIVEN in thing}
    result = made_by(folder)
    before = kept_overrides(folder, {*result, *(thing[OBJECT_ID] for thing in things)})
    ours = _written.setdefault(folder, set())
    objects = {i: one for i, one in before.objects.items() if i not in ours} | said
    white = before.white if "white" not in ours else None
    stated = next((thing for thing in things if WHITE in thing), None)
    if stated is not None:
        white = White(stated[OBJECT_ID], tuple(stated[WHITE]))
    now = Overrides({i: one for i, one in objects.items() if one.any}, white)
    if now.as_dict() != before.as_dict():
        write_bytes(folder / OVERRIDES, json.dumps(now.as_dict(), indent=1).encode())
    ours |= said.keys() | ({"white"} if stated is not None else set())
    return {i for i, one in result.items() if now.of(i).as_dict() != (one.get("given") or {})}


def forget() -> None:
    """Know nothing of what was written in this session."""
    _written.clear()
