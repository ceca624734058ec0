"""Results that were moved: what is missing from the open file, and redirecting all of it to the new folder.

A result is identified by its run's key, never by its name alone.
"""

import time
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import bpy

from ...core.errors import BadInputError
from ...core.kinds import Limit, Shown
from ...core.results.result_folders import FOLDER_BESIDE
from ...core.results.room_file import MATERIALS, layout_of, run_of
from ..custom_properties import IMAGE, LAYOUT, OBJECT_ID, RESULT, RUN
from ..data.images import relative_to, result_of
from ..refused import listed
from . import file
from .default_folders import display_path
from .images import KEPT, is_there, kept_path, path_of, result_images

MAX_SUBFOLDERS: Limit[int] = 200
"""Sub-folders of a chosen folder that are searched."""
CACHE_SECONDS: Shown[float] = 2.0
"""Seconds for which the missing files are cached: panels ask at each redraw."""


@dataclass(frozen=True)
class Missing:
    """What is missing of one result.

    Attributes
    ----------
    folder, run
        Its former folder, and its run's key; '' where the file does not have that.
    images : tuple of str
        Names of the missing image files.
    gone : bool
        The folder itself is missing, or is no result any more.
    """

    folder: Path
    run: str
    images: tuple[str, ...]
    gone: bool

    @property
    def sentence(self) -> str:
        """The message for the artist."""
        path = display_path(self.folder)
        if self.gone:
            lost = "its pictures can't be shown" if self.images else "what was found of each object can't be listed"
            return f"The result folder '{path}' is gone: {lost}."
        verb = "are" if len(self.images) > 1 else "is"
        return f"{listed(self.images)} {verb} missing in '{path}' and can't be shown; find the result or run again."


_cache: tuple[float, list[Missing], list[Path]] = -CACHE_SECONDS, [], []


def forget() -> None:
    """Clear the cache."""
    global _cache
    _cache = (-CACHE_SECONDS, *_cache[1:])


def cached_state() -> tuple[list[Missing], list[Path]]:
    """`missing` and `outdated`, computed every `CACHE_SECONDS` at most."""
    global _cache
    checked_at, missing_before, _ = _cache
    if time.monotonic() - checked_at >= CACHE_SECONDS:
        _cache = time.monotonic(), missing(), outdated()
        still_missing = {entry.folder for entry in _cache[1]}
        for entry in missing_before:
            # Restored by hand; reloaded later, as a panel may be drawing.
            if entry.folder not in still_missing and not bpy.app.background:
                bpy.app.timers.register(partial(reload, entry.folder))
    return _cache[1:]


def outdated() -> list[Path]:
    """Results that were recovered again with another layout of their images than the open file's objects have."""
    return sorted({result_of(Path(image[IMAGE])) for image in _outdated_images()})


def _outdated_images() -> list[bpy.types.Image]:
    """Images whose file has another layout than theirs."""
    outdated_images = []
    for image in result_images():
        source = Path(image[IMAGE])
        if LAYOUT in image and not image.packed_file and path_of(image) == source:
            result = file.read(result_of(source))
            if result is not None and result.layout not in ("", image[LAYOUT]):
                outdated_images.append(image)
    return outdated_images


def reload(folder: Path) -> None:
    """Reload the images of a result that could not be read before."""
    for image in result_images():
        if Path(image[IMAGE]).is_relative_to(folder) and not image.packed_file and not image.has_data:
            image.reload()


def missing() -> list[Missing]:
    """What is missing of the open file's results."""
    runs: dict[Path, set[str]] = {}
    for owner in _owners():
        runs.setdefault(Path(owner[RESULT]), set()).add(owner.get(RUN, ""))
    lost_images: dict[Path, list[str]] = {}
    for image in result_images():
        source = Path(image[IMAGE])
        if not image.packed_file and not is_there(path_of(image)):
            folder = next((folder for folder in runs if source.is_relative_to(folder)), source.parent)
            lost_images.setdefault(folder, []).append(source.name)
    results = []
    for folder in sorted({*runs, *lost_images}):
        gone = not (folder / MATERIALS).is_file()
        if gone or folder in lost_images:
            known_runs = runs.get(folder, set()) - {""}
            run = known_runs.pop() if len(known_runs) == 1 else ""
            results.append(Missing(folder, run, tuple(sorted(lost_images.get(folder, ()))), gone))
    return results


def search(results_root: Path) -> list[str]:
    """Search likely folders for missing results and redirect the open file; a sentence on each one found."""
    messages = []
    for image in _outdated_images():
        path = kept_path(Path(image[IMAGE]), image[LAYOUT])
        if is_there(path):
            _set_path(image, path)
    for lost in missing():
        if not lost.gone:
            count = repoint(lost.folder, lost.folder)
            if count:
                verb = "are" if count > 1 else "is"
                messages.append(
                    f"{count} picture{'s' * (count > 1)} {verb} shown from '{display_path(lost.folder)}', as the "
                    f"file's own {verb} gone; save the file to keep it so."
                )
            continue
        name, candidates = lost.folder.name, []
        if bpy.data.filepath:
            beside = Path(bpy.data.filepath).parent
            candidates = [beside, beside / name, beside / FOLDER_BESIDE / name]
        for place in (*candidates, results_root / name):
            if lost.run and run_of(place) == lost.run or _keeps_images(place, lost):
                repoint(lost.folder, place)
                messages.append(
                    f"The result '{name}' was moved and is found again in '{display_path(place)}'; save the file to "
                    "keep it so."
                )
                break
    forget()
    return messages


def find(lost: Missing, chosen: Path) -> Path:
    """The missing result in a chosen folder, or one level below or above; raises `BadInputError` if not found."""
    try:
        subfolders = sorted(part for part in chosen.iterdir() if part.is_dir())[:MAX_SUBFOLDERS]
    except OSError as error:
        raise BadInputError(f"'{chosen}' can't be opened ({error.strerror or error}); choose a folder.") from error
    results = [place for place in (chosen, *subfolders, chosen.parent) if (place / MATERIALS).is_file()]
    for place in results:
        fits = run_of(place) == lost.run if lost.run else _may_be_result(place, lost.folder)
        if fits or _keeps_images(place, lost):
            return place
    if not results:
        raise BadInputError(
            f"'{chosen}' is no result folder ('{MATERIALS}' is missing); choose the one that the run wrote."
        )
    raise BadInputError(
        f"'{results[0]}' holds another run than '{lost.folder.name}' did; choose that one's folder, "
        "or run again and bring in the new one."
    )


def repoint(old: Path, new: Path) -> int:
    """Redirect images, objects and rooms of the open file from a result folder to its new location.

    Images that have another source (packed, or beside the file) stay as they are. Returns how many now refer to `new`.
    """
    count = 0
    for image in result_images():
        source = Path(image[IMAGE])
        if not source.is_relative_to(old):
            continue
        path = path_of(image)
        new_path = new / source.relative_to(old)
        image[IMAGE] = str(new_path)
        if path.is_relative_to(old / KEPT) and is_there(new / path.relative_to(old)):
            new_path = new / path.relative_to(old)
        elif LAYOUT in image and layout_of(new) not in ("", image[LAYOUT]):
            continue  # a missing picture is better than a wrong one
        if image.packed_file or not is_there(new_path) or (is_there(path) and not path.is_relative_to(old)):
            continue
        if old == new and is_there(path):
            continue
        _set_path(image, new_path)
        count += 1
    for owner in _owners():
        if Path(owner[RESULT]) == old:
            owner[RESULT] = str(new)
    forget()
    file.forget()
    return count


def _set_path(image: bpy.types.Image, path: Path) -> None:
    image.filepath = str(path)
    if bpy.data.filepath:
        relative_to(image, Path(bpy.data.filepath).parent)
    image.reload()


def _owners() -> Iterable[bpy.types.ID]:
    owners = (*bpy.data.objects, *bpy.data.collections)
    return [owner for owner in owners if owner.get(RESULT) and not owner.library]


def _keeps_images(folder: Path, lost: Missing) -> bool:
    """Whether a folder's kept images include all that the open file is missing, whatever its current run."""
    paths = [path_of(image) for image in result_images()]
    paths = [path.relative_to(lost.folder) for path in paths if path.is_relative_to(lost.folder / KEPT)]
    return bool(paths) and all(is_there(folder / path) for path in paths)


def _may_be_result(place: Path, folder: Path) -> bool:
    """Whether a result of unknown run may be that of `folder`: it has all of its objects."""
    result = file.read(place)
    object_ids = {obj.get(OBJECT_ID) for obj in bpy.data.objects if Path(str(obj.get(RESULT, ""))) == folder}
    return result is not None and not result.run and object_ids <= set(result.objects)
