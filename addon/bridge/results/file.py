"""Contents of result folders, and the scene's objects of each: an object and a folder are matched by run.

An object's number alone is ambiguous: every room counts from 0, and a folder may have been overwritten by another run.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ...core.brdf.material import renamed
from ...core.io.files import json_if_sound
from ...core.io.folder import MATERIALS, REPORT
from ..custom_properties import OBJECT_ID, RESULT, RUN
from ..data.instances import slots_of
from ..data.materials import MODEL

FITS, EARLIER, UNKNOWN, GONE = "FITS", "EARLIER", "UNTOLD", "GONE"
"""State of an object relative to its result: it is of the run in the folder; of another one; unknown, as the object or
the folder is older than runs' keys; or the result no longer exists."""


@dataclass(frozen=True)
class Result:
    """A result folder's content; empty where a file is absent or damaged.

    Attributes
    ----------
    run, layout : str
        Keys of the run and of the layout of its images; '' where it is older than such keys.
    objects : dict of int to dict
        Entries of materials.json by `object_id`.
    stages : dict of str to dict
        Of report.json.
    """

    folder: Path
    run: str
    layout: str
    objects: dict[int, dict[str, Any]]
    stages: dict[str, dict[str, Any]]


_cache: dict[Path, tuple[tuple, Result]] = {}


def read(folder: Path) -> Result | None:
    """A result folder's content, read again when a file has changed; None where there is neither file."""
    stamp = tuple(_stamp(folder / name) for name in (MATERIALS, REPORT))
    if not any(stamp):
        return None
    if folder not in _cache or _cache[folder][0] != stamp:
        if len(_cache) > 8:
            _cache.clear()
        report, materials = json_if_sound(folder / REPORT), json_if_sound(folder / MATERIALS)
        run, layout = (_value_of_type(materials, key, str) for key in ("run", "layout"))
        entries = _value_of_type(materials, "objects", list)
        sound = (entry for entry in entries if isinstance(entry, dict) and "object_id" in entry)
        objects = {entry["object_id"]: renamed(entry) for entry in sound}
        _cache[folder] = stamp, Result(folder, run, layout, objects, _value_of_type(report, "stages", dict))
    return _cache[folder][1]


def _value_of_type(document: dict[str, Any], key: str, kind: type):
    """The value of `key`; an empty `kind` where that is absent or of another type."""
    return document[key] if isinstance(document.get(key), kind) else kind()


def forget() -> None:
    """Clear the cache."""
    _cache.clear()


def result_states(objects: Iterable[bpy.types.Object]) -> dict[bpy.types.Object, tuple[str, Result | None]]:
    """State of each recovered object (`FITS` and the others), and its result."""
    states, folders = {}, {}
    for obj in objects:
        if obj.type != "MESH" or OBJECT_ID not in obj:
            continue
        folder_name, run = obj.get(RESULT), obj.get(RUN)
        if not folder_name:
            if any(slot.material and MODEL in slot.material for slot in obj.material_slots):
                states[obj] = UNKNOWN, None
            continue
        if folder_name not in folders:
            folders[folder_name] = read(Path(folder_name))
        result = folders[folder_name]
        if result is None:
            state = GONE
        elif not run or not result.run:
            state = UNKNOWN
        else:
            state = FITS if run == result.run else EARLIER
        states[obj] = state, result
    return states


def result_state(obj: bpy.types.Object | None) -> tuple[str, Result | None]:
    """`result_states` of one object; ('', None) for one that was not recovered."""
    return result_states([obj]).get(obj, ("", None)) if obj is not None else ("", None)


def rows_of_parts(objects: Iterable[bpy.types.Object]) -> dict[bpy.types.Object, dict[int, dict[str, Any]]]:
    """The entries in materials.json of each object's instances, where its run is the one in its folder."""
    found = {}
    for obj, (state, result) in result_states(objects).items():
        if state == FITS and (parts := {i: result.objects[i] for i in slots_of(obj) if i in result.objects}):
            found[obj] = parts
    return found


def _stamp(path: Path) -> tuple[int, int] | None:
    with suppress(OSError):
        stat = path.stat()
        return stat.st_mtime_ns, stat.st_size
    return None
