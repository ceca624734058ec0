"""A result folder's images in the open file: referred to, copied beside the file, or packed into it."""

import filecmp
import os
import shutil
from collections.abc import Iterable
from itertools import count
from pathlib import Path

import bpy

from ...core.atomic import replacing
from ...core.errors import BadInputError, StorageError
from ...core.io.folder import capture_name
from ...core.results.room_file import layout_of
from ..data.images import DATA, RADIANCE, image_name, load_image, relative_to, result_of, tiles_of
from ..marks import IMAGE, LAYOUT
from ..refused import refused
from ..scene.write import ALBEDO, BASE_COLOR, SCENE_FILES, SHADING

RESULT, FOLDER, PACK = "RESULT", "FOLDER", "PACK"
"""Refer to the result folder; copy into a folder beside the saved .blend; pack into it."""
KEPT = "kept"
"""Folder of a result with the images, by layout, that saved files refer to."""
COLOUR_SPACES = {
    BASE_COLOR: RADIANCE,
    ALBEDO: RADIANCE,
    SHADING: RADIANCE,
    "lit_diffuse.exr": RADIANCE,
    "coverage.exr": DATA,
    "albedo_error.exr": DATA,
    "evidence.exr": DATA,
}
NEVER_SAVED = "Images can't go beside a file that was never saved; save it first, or pack them."
BAKED = (BASE_COLOR, ALBEDO, SHADING)


def bring(folder: Path | str, where: str = RESULT) -> bpy.types.Image | None:
    """Load the baked images (`BAKED`), in place of an earlier call's; returns the one that Base Color shows.

    Raises
    ------
    BadInputError
        An image is damaged, or `FOLDER` is wished for and the file was never saved.
    StorageError
        They can't be copied.
    """
    folder = Path(folder).absolute()
    found = {name: image(folder, name, where) for name in BAKED if (folder / name).exists()}
    return found.get(BASE_COLOR)


def image(
    folder: Path | str, name: str, where: str = RESULT, keep: bool = True, share: bool = False
) -> bpy.types.Image:
    """One image of a result folder in its content's colour space; `share`: one that is there already, read again."""
    source = Path(folder).absolute() / name
    earlier = [one for one in bpy.data.images if share and one.get(IMAGE) == str(source) and not one.library]
    if earlier:
        if not earlier[0].packed_file:
            earlier[0].reload()
        return earlier[0]
    loaded = load_image(source, image_name(capture_name(source.parent), name), COLOUR_SPACES[name], keep=keep)
    settle([loaded], where)
    return loaded


def drop_unused(folders: Iterable[str]) -> None:
    """Remove the images of result folders other than `folders` that nothing shows."""
    for one in list(bpy.data.images):
        source = one.get(IMAGE)
        if source and str(Path(source).parent) not in folders and one.users == int(one.use_fake_user):
            bpy.data.images.remove(one)


def check(where: str) -> None:
    """Raise `BadInputError` where images can't go `where` in the open file: best asked before a run, not after it."""
    if where == FOLDER and not bpy.data.filepath:
        raise BadInputError(NEVER_SAVED)


def settle(images: Iterable[bpy.types.Image], where: str = RESULT) -> None:
    """Images that are in the file already go where the artist wants them.

    Parameters
    ----------
    images : iterable of bpy.types.Image
        Of result folders: those without a file of their own, and linked ones, are passed over. An earlier image of the
        same file gives its place and its name to the new one, and goes.
    where : str
        `RESULT`: refer to the result folder, relative to the open file where it was saved; `FOLDER`: copy beside the
        open file; `PACK`: into it.

    Raises
    ------
    BadInputError
        `FOLDER` is wished for and the file was never saved, or an image's file is gone.
    StorageError
        They can't be copied.
    """
    check(where)
    places = {}
    for one in {one.session_uid: one for one in images}.values():
        if one.library or one.source not in ("FILE", "TILED"):
            continue
        source = Path(one.get(IMAGE) or bpy.path.abspath(one.filepath))
        one[IMAGE] = str(source)
        if not one.packed_file and not is_there(source):
            raise BadInputError(f"'{source}' is missing; run the recovery again to its end.")
        places[one.session_uid] = one, source
    for one, source in places.values():
        if not one.packed_file:
            one.filepath = str(_beside(source) if where == FOLDER else source)
    gone = set()  # what can fail is done: from here on images give way to others
    for number, (one, source) in places.items():
        if number in gone:
            continue
        same = [other for other in bpy.data.images if other.get(IMAGE) == str(source) and not other.library]
        for earlier in [other for other in same if other != one]:
            gone.add(earlier.session_uid)
            replace(earlier, one)
        if one.packed_file:
            continue
        if where == PACK:
            one.pack()
        elif bpy.data.filepath:
            relative_to(one, Path(bpy.data.filepath).parent)


def replace(earlier: bpy.types.Image, one: bpy.types.Image) -> None:
    """Let `one` stand wherever `earlier` did, under its name; `earlier` is removed."""
    label, kept = earlier.name, earlier.use_fake_user
    earlier.user_remap(one)
    bpy.data.images.remove(earlier)
    one.name, one.use_fake_user = label, one.use_fake_user or kept


def keep(saved: Path) -> None:
    """Let the open file, before it is saved, refer to images that no run overwrites which lays its images out anew.

    They are further names (hard links) of the result's own files, so they take no space until a run writes those anew;
    copies where the disk knows no such links. What can't be kept stays referred to as it was.

    Parameters
    ----------
    saved : Path
        Where the file will be. A result's own scene.blend is overwritten along with its images and refers to those.
    """
    for one in of_results():
        source = Path(one[IMAGE])
        folder = result_of(source)
        shown = path_of(one)
        if one.packed_file or shown != source or saved.parent == folder and saved.name in SCENE_FILES:
            continue
        layout = one.get(LAYOUT)
        if not layout or layout_of(folder) != layout:
            continue
        target = kept_path(source, layout)
        try:
            for part in tiles_of(source) or [source]:
                link(part, target.parent / part.name)
        except StorageError:
            continue
        relative = one.filepath.startswith("//")
        one.filepath_raw = bpy.path.relpath(str(target)) if relative else str(target)  # the picture is the same


def link(source: Path, target: Path) -> None:
    """Make `target` a further name of a file, or a copy where that can't be; raises `StorageError`."""
    if target.exists() and filecmp.cmp(source, target):
        return
    with refused(f"'{target.parent}' can't be made", "check its rights"):
        target.parent.mkdir(parents=True, exist_ok=True)
    with replacing(target) as temporary:
        try:
            os.link(source, temporary)
        except OSError:
            shutil.copy2(source, temporary)


def kept_path(source: Path, layout: str) -> Path:
    """Where an image of a result folder is kept for saved files."""
    folder = result_of(source)
    return folder / KEPT / layout / source.relative_to(folder)


def of_results() -> list[bpy.types.Image]:
    """The open file's own images that came from a result."""
    return [one for one in bpy.data.images if one.get(IMAGE) and not one.library and one.source in ("FILE", "TILED")]


def path_of(image: bpy.types.Image) -> Path:
    """The file that an image shows."""
    return Path(os.path.normpath(bpy.path.abspath(image.filepath)))


def is_there(path: Path) -> bool:
    """Whether an image's file exists; of tiles (``<UDIM>``) any."""
    return path.is_file() or bool(tiles_of(path))


def _beside(source: Path) -> Path:
    """A copy of `source` in the folder of images beside the saved file; each result and layout has one of its own."""
    check(FOLDER)
    saved, layout = Path(bpy.data.filepath), layout_of(result_of(source))
    theirs = set()
    for one in bpy.data.images:
        folder = Path(one[IMAGE]).parent if one.get(IMAGE) else source.parent
        if not folder.is_relative_to(source.parent) and not source.is_relative_to(folder):  # objects' lie deeper
            theirs.add(path_of(one).parent)
    names = (f"{saved.stem} images{f' {number}' if number > 1 else ''}" for number in count(1))
    target = next(one for one in (saved.parent / name / layout for name in names) if one not in theirs) / source.name
    with refused(f"'{target}' can't be written", "free some space or save the file elsewhere"):
        target.parent.mkdir(parents=True, exist_ok=True)
        for one in tiles_of(source) or [source]:
            shutil.copyfile(one, target.parent / one.name)
    return target
