"""Results that were moved: what an open file misses, and pointing all of it to where the result lies now.

A result is known by its run's key, never by its name alone.
"""

import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import bpy

from ...core.errors import BadInputError
from ...core.kinds import Limit, Shown
from ...core.results.place import BESIDE
from ...core.results.room_file import MATERIALS, layout_of, run_of
from ..data.images import relative_to, result_of
from ..marks import IMAGE, LAYOUT, OBJECT_ID, RESULT, RUN
from . import file
from .home import shown
from .images import KEPT, is_there, kept_path, of_results, path_of

NAMED: Shown[int] = 3
"""Images that a sentence names before it counts the rest."""
LOOKED_AT: Limit[int] = 200
"""Sub-folders of a chosen folder that are looked at."""
FRESH: Shown[float] = 2.0
"""Seconds for which what is missing is not looked up again: panels ask at each picture."""


@dataclass(frozen=True)
class Missing:
    """What a file misses of one result.

    Attributes
    ----------
    folder : Path
        Where the result lay.
    run : str
        The run's key; '' where nothing in the file tells it.
    images : tuple of str
        Names of the image files that can't be shown.
    gone : bool
        The folder itself is not there, or holds no result any more.
    """

    folder: Path
    run: str
    images: tuple[str, ...]
    gone: bool

    @property
    def sentence(self) -> str:
        """What to tell the artist."""
        where = shown(self.folder)
        if self.gone:
            what = "its pictures can't be shown" if self.images else "what was found of each object can't be listed"
            return f"The result folder '{where}' is gone: {what}."
        names, count = ", ".join(f"'{name}'" for name in self.images[:NAMED]), len(self.images)
        more = f" and {count - NAMED} more" if count > NAMED else ""
        return (
            f"{names}{more} {'are' if count > 1 else 'is'} missing in '{where}' and can't be shown; find the "
            "result or run again."
        )


_known: tuple[float, list[Missing], list[Path]] = -FRESH, [], []


def forget() -> None:
    """Look up again what is missing."""
    global _known
    _known = (-FRESH, *_known[1:])


def known() -> tuple[list[Missing], list[Path]]:
    """`missing` and `overtaken`, looked up every `FRESH` seconds at most."""
    global _known
    looked, before, _ = _known
    if time.monotonic() - looked >= FRESH:
        _known = time.monotonic(), missing(), overtaken()
        left = {one.folder for one in _known[1]}
        for one in before:
            if one.folder not in left and not bpy.app.background:  # put back by hand; not now: a panel may be drawing
                bpy.app.timers.register(partial(reload, one.folder))
    return _known[1:]


def overtaken() -> list[Path]:
    """Results that were recovered anew with their images laid out otherwise than the open file's objects ask for."""
    return sorted({result_of(Path(one[IMAGE])) for one in _overtaken()})


def _overtaken() -> list[bpy.types.Image]:
    """Images that show a picture of another layout than theirs."""
    found = []
    for one in of_results():
        source = Path(one[IMAGE])
        if LAYOUT in one and not one.packed_file and path_of(one) == source:
            result = file.read(result_of(source))
            if result is not None and result.layout not in ("", one[LAYOUT]):
                found.append(one)
    return found


def reload(folder: Path) -> None:
    """Read those images of a result again that could not be read before."""
    for one in of_results():
        if Path(one[IMAGE]).is_relative_to(folder) and not one.packed_file and not one.has_data:
            one.reload()


def missing() -> list[Missing]:
    """What the open file misses of the results that it was made from."""
    runs: dict[Path, set[str]] = {}
    for owner in _owners():
        runs.setdefault(Path(owner[RESULT]), set()).add(owner.get(RUN, ""))
    lost: dict[Path, list[str]] = {}
    for one in of_results():
        source = Path(one[IMAGE])
        if not one.packed_file and not is_there(path_of(one)):
            folder = next((folder for folder in runs if source.is_relative_to(folder)), source.parent)
            lost.setdefault(folder, []).append(source.name)
    found = []
    for folder in sorted({*runs, *lost}):
        gone = not (folder / MATERIALS).is_file()
        if gone or folder in lost:
            known = runs.get(folder, set()) - {""}
            found.append(
                Missing(folder, known.pop() if len(known) == 1 else "", tuple(sorted(lost.get(folder, ()))), gone)
            )
    return found


def search(home: Path) -> list[str]:
    """Look for what is missing where it most likely is, and point the open file there; a sentence on each find."""
    told = []
    for image in _overtaken():
        kept = kept_path(Path(image[IMAGE]), image[LAYOUT])
        if is_there(kept):
            _show(image, kept)
    for one in missing():
        if not one.gone:
            count = repoint(one.folder, one.folder)
            if count:
                told.append(
                    f"{count} picture{'s' * (count > 1)} {'are' if count > 1 else 'is'} shown from "
                    f"'{shown(one.folder)}', as the file's own {'are' if count > 1 else 'is'} gone; save the "
                    "file to keep it so."
                )
            continue
        beside = [Path(bpy.data.filepath).parent] if bpy.data.filepath else []
        places = [
            *beside,
            *(folder / part / one.folder.name for folder in beside for part in ("", BESIDE)),
            home / one.folder.name,
        ]
        new = next((place for place in places if one.run and run_of(place) == one.run or _keeps(place, one)), None)
        if new is not None:
            repoint(one.folder, new)
            told.append(
                f"The result '{one.folder.name}' was moved and is found again in '{shown(new)}'; save the file "
                "to keep it so."
            )
    forget()
    return told


def find(one: Missing, chosen: Path) -> Path:
    """The missing result in a chosen folder, or one level below or above; raises `BadInputError` where it isn't."""
    try:
        below = sorted(part for part in chosen.iterdir() if part.is_dir())[:LOOKED_AT]
    except OSError as error:
        raise BadInputError(f"'{chosen}' can't be opened ({error.strerror or error}); choose a folder.") from error
    results = [place for place in (chosen, *below, chosen.parent) if (place / MATERIALS).is_file()]
    for place in results:
        if ((run_of(place) == one.run) if one.run else _holds(place, one.folder)) or _keeps(place, one):
            return place
    if not results:
        raise BadInputError(
            f"'{chosen}' is no result folder ('{MATERIALS}' is missing); choose the one that the run wrote."
        )
    raise BadInputError(
        f"'{results[0]}' holds another run than '{one.folder.name}' did; choose that one's folder, "
        "or run again and bring in the new one."
    )


def repoint(old: Path, new: Path) -> int:
    """Point images, objects and rooms of the open file from a result folder to where it is now.

    Images that can be shown from elsewhere (packed, or beside the file) stay as they are.

    Returns
    -------
    int
        How many images are shown from `new`.
    """
    count = 0
    for one in of_results():
        source = Path(one[IMAGE])
        if not source.is_relative_to(old):
            continue
        path = path_of(one)
        there = new / source.relative_to(old)
        one[IMAGE] = str(there)
        if path.is_relative_to(old / KEPT) and is_there(new / path.relative_to(old)):
            there = new / path.relative_to(old)
        elif LAYOUT in one and layout_of(new) not in ("", one[LAYOUT]):
            continue  # a picture that is missing is better than a wrong one
        if one.packed_file or not is_there(there) or (is_there(path) and not path.is_relative_to(old)):
            continue
        if old == new and is_there(path):
            continue
        _show(one, there)
        count += 1
    for owner in _owners():
        if Path(owner[RESULT]) == old:
            owner[RESULT] = str(new)
    forget()
    file.forget()
    return count


def _show(image: bpy.types.Image, path: Path) -> None:
    image.filepath = str(path)
    if bpy.data.filepath:
        relative_to(image, Path(bpy.data.filepath).parent)
    image.reload()


def _owners() -> Iterable[bpy.types.ID]:
    return [
        one for kind in (bpy.data.objects, bpy.data.collections) for one in kind if one.get(RESULT) and not one.library
    ]


def _keeps(place: Path, one: Missing) -> bool:
    """Whether a folder keeps the very images that an open file misses, whatever run it holds now."""
    kept = [path_of(image) for image in of_results()]
    kept = [path.relative_to(one.folder) for path in kept if path.is_relative_to(one.folder / KEPT)]
    return bool(kept) and all(is_there(place / path) for path in kept)


def _holds(place: Path, folder: Path) -> bool:
    """Whether a result whose run nobody can tell may be that of `folder`: it has all of its objects."""
    result = file.read(place)
    wanted = set()
    for one in bpy.data.objects:
        with suppress(TypeError):
            if Path(one.get(RESULT, "")) == folder:
                wanted.add(one.get(OBJECT_ID))
    return result is not None and not result.run and wanted <= set(result.objects)
