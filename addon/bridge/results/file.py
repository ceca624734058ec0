"""What result folders say, and which of a scene's objects each is about: an object and a folder belong together by run.

An object's number alone says nothing: every room counts from 0, and a folder may hold another run than it did.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ...core.brdf.material import renamed
from ...core.io.files import json_if_sound
from ...core.io.folder import MATERIALS, REPORT
from ..data.materials import MODEL
from ..marks import OBJECT_ID, RESULT, RUN

FITS, EARLIER, UNTOLD, GONE = "FITS", "EARLIER", "UNTOLD", "GONE"
"""How an object stands to the result that it came from: it is of the run that lies there; of another one; it can't be
told, as the object or the folder is older than runs' keys; or there is no result any more."""


@dataclass(frozen=True)
class Result:
    """A result folder's content; empty where a file is absent or damaged.

    Attributes
    ----------
    run : str
        Key of the run; '' where it is older than such keys.
    layout : str
        Key of how its images are laid out; '' likewise.
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


_read: dict[Path, tuple[tuple, Result]] = {}


def read(folder: Path) -> Result | None:
    """What a result folder says, read again when a file has changed; None where there is neither file."""
    stamp = tuple(_stamp(folder / name) for name in (MATERIALS, REPORT))
    if not any(stamp):
        return None
    if folder not in _read or _read[folder][0] != stamp:
        if len(_read) > 8:
            _read.clear()
        report, told = json_if_sound(folder / REPORT), json_if_sound(folder / MATERIALS)
        listed = [one for one in _of_kind(told, "objects", list) if isinstance(one, dict) and "object_id" in one]
        result = Result(
            folder,
            _of_kind(told, "run", str),
            _of_kind(told, "layout", str),
            {one["object_id"]: renamed(one) for one in listed},
            _of_kind(report, "stages", dict),
        )
        _read[folder] = stamp, result
    return _read[folder][1]


def _of_kind(told: dict[str, Any], key: str, kind: type):
    """What is told under `key`; nothing of its kind where that is absent or of another."""
    return told[key] if isinstance(told.get(key), kind) else kind()


def forget() -> None:
    """Read everything again."""
    _read.clear()


def standings(things: Iterable[bpy.types.Object]) -> dict[bpy.types.Object, tuple[str, Result | None]]:
    """How each recovered object stands to its result (`FITS` and its neighbours), and that result."""
    found, folders = {}, {}
    for thing in things:
        if thing.type != "MESH" or OBJECT_ID not in thing:
            continue
        told, run = thing.get(RESULT), thing.get(RUN)
        if not told:
            if any(slot.material is not None and MODEL in slot.material for slot in thing.material_slots):
                found[thing] = UNTOLD, None
            continue
        if told not in folders:
            folders[told] = read(Path(told))
        result = folders[told]
        if result is None:
            state = GONE
        elif not run or not result.run:
            state = UNTOLD
        else:
            state = FITS if run == result.run else EARLIER
        found[thing] = state, result
    return found


def standing(thing: bpy.types.Object | None) -> tuple[str, Result | None]:
    """`standings` of one object; ('', None) for what nothing was recovered of."""
    return standings([thing]).get(thing, ("", None)) if thing is not None else ("", None)


def rows(things: Iterable[bpy.types.Object]) -> dict[bpy.types.Object, dict[str, Any]]:
    """The entry of materials.json of each object whose run lies in its folder."""
    return {
        thing: result.objects[thing[OBJECT_ID]]
        for thing, (state, result) in standings(things).items()
        if state == FITS and thing[OBJECT_ID] in result.objects
    }


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size
