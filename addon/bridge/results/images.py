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
from ..custom_properties import IMAGE, LAYOUT
from ..data.images import DATA, RADIANCE, image_name, load_image, relative_to, result_of, tiles_of
from ..refused import refused
from ..scene.write import ALBEDO, BASE_COLOR, SCENE_FILES, SHADING

RESULT, FOLDER, PACK = "RESULT", "FOLDER", "PACK"
"""Refer to the result folder; copy into a folder beside the saved .blend; pack into it."""
KEPT = "kept"
"""Sub-folder of a result with the images, by layout, that saved .blend files refer to."""
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


def load_baked(folder: Path | str, where: str = RESULT) -> bpy.types.Image | None:
    """Load the baked images (`BAKED`), replacing those of an earlier call; returns the one for Base Color.

    Raises as `image` and `settle`.
    """
    folder = Path(folder).absolute()
    images = {name: image(folder, name, where) for name in BAKED if (folder / name).exists()}
    return images.get(BASE_COLOR)


def image(
    folder: Path | str, name: str, where: str = RESULT, keep: bool = True, share: bool = False
) -> bpy.types.Image:
    """One image of a result folder in its content's colour space; `share`: reuse and reload an existing one."""
    source = Path(folder).absolute() / name
    existing = [item for item in bpy.data.images if share and item.get(IMAGE) == str(source) and not item.library]
    if existing:
        if not existing[0].packed_file:
            existing[0].reload()
        return existing[0]
    loaded = load_image(source, image_name(capture_name(source.parent), name), COLOUR_SPACES[name], keep=keep)
    settle([loaded], where)
    return loaded


def drop_unused(folders: Iterable[str]) -> None:
    """Remove the images of result folders other than `folders` that nothing uses."""
    for image in list(bpy.data.images):
        source = image.get(IMAGE)
        if source and str(Path(source).parent) not in folders and image.users == int(image.use_fake_user):
            bpy.data.images.remove(image)


def check(where: str) -> None:
    """Raise `BadInputError` where images can't go `where` in the open file; check before a run, not after it."""
    if where == FOLDER and not bpy.data.filepath:
        raise BadInputError(NEVER_SAVED)


def settle(images: Iterable[bpy.types.Image], where: str = RESULT) -> None:
    """Store images of the open file where the artist wants them.

    Parameters
    ----------
    images : iterable of bpy.types.Image
        Of result folders: those without a file of their own, and linked ones, are skipped. The new image takes users
        and name of an earlier one of the same file, which is removed.
    where : str
        `RESULT`: refer to the result folder, relative to the open file where it was saved; `FOLDER`: copy beside the
        open file; `PACK`: into it.

    Raises
    ------
    BadInputError, StorageError
        `where` is `FOLDER` and the file was never saved, or an image's file is missing; they can't be copied.
    """
    check(where)
    targets = {}
    for image in {image.session_uid: image for image in images}.values():
        if image.library or image.source not in ("FILE", "TILED"):
            continue
        source = Path(image.get(IMAGE) or bpy.path.abspath(image.filepath))
        image[IMAGE] = str(source)
        if not image.packed_file and not is_there(source):
            raise BadInputError(f"'{source}' is missing; run the recovery again to its end.")
        targets[image.session_uid] = image, source
    for image, source in targets.values():
        if not image.packed_file:
            image.filepath = str(_copy_beside_file(source) if where == FOLDER else source)
    removed = set()  # nothing below can fail: from here on images are replaced
    for uid, (image, source) in targets.items():
        if uid in removed:
            continue
        same_file = [other for other in bpy.data.images if other.get(IMAGE) == str(source) and not other.library]
        for earlier in [other for other in same_file if other != image]:
            removed.add(earlier.session_uid)
            replace(earlier, image)
        if image.packed_file:
            continue
        if where == PACK:
            image.pack()
        elif bpy.data.filepath:
            relative_to(image, Path(bpy.data.filepath).parent)


def replace(earlier: bpy.types.Image, new: bpy.types.Image) -> None:
    """Replace `earlier` by `new` everywhere, under its name; `earlier` is removed."""
    name, fake_user = earlier.name, earlier.use_fake_user
    earlier.user_remap(new)
    bpy.data.images.remove(earlier)
    new.name, new.use_fake_user = name, new.use_fake_user or fake_user


def keep(saved: Path) -> None:
    """Before saving, make the open file refer to images that a later run with another layout does not overwrite.

    They are hard links to the result's own files, so they take no space until a run rewrites those; copies where the
    file system has no hard links. An image for which that fails keeps its path.

    `saved` is the file's path: a result's own scene.blend is overwritten together with its images and refers to those.
    """
    for image in result_images():
        source = Path(image[IMAGE])
        folder = result_of(source)
        path = path_of(image)
        if image.packed_file or path != source or saved.parent == folder and saved.name in SCENE_FILES:
            continue
        layout = image.get(LAYOUT)
        if not layout or layout_of(folder) != layout:
            continue
        target = kept_path(source, layout)
        try:
            for part in tiles_of(source) or [source]:
                link(part, target.parent / part.name)
        except StorageError:
            continue
        relative = image.filepath.startswith("//")
        image.filepath_raw = bpy.path.relpath(str(target)) if relative else str(target)  # the pixels are the same


def link(source: Path, target: Path) -> None:
    """Make `target` a hard link to a file, or a copy where that fails; raises `StorageError`."""
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
    """Path at which an image of a result folder is kept for saved files."""
    folder = result_of(source)
    return folder / KEPT / layout / source.relative_to(folder)


def result_images() -> list[bpy.types.Image]:
    """The open file's local images that came from a result."""
    local = (image for image in bpy.data.images if image.get(IMAGE) and not image.library)
    return [image for image in local if image.source in ("FILE", "TILED")]


def path_of(image: bpy.types.Image) -> Path:
    """The file of an image."""
    return Path(os.path.normpath(bpy.path.abspath(image.filepath)))


def is_there(path: Path) -> bool:
    """Whether an image's file exists; of tiles (``<UDIM>``) any."""
    return path.is_file() or bool(tiles_of(path))


def _copy_beside_file(source: Path) -> Path:
    """A copy of `source` in the folder of images beside the saved file; each result and layout has its own."""
    check(FOLDER)
    saved, layout = Path(bpy.data.filepath), layout_of(result_of(source))
    used = set()
    for image in bpy.data.images:
        folder = Path(image[IMAGE]).parent if image.get(IMAGE) else source.parent
        # Those of objects are deeper.
        if not folder.is_relative_to(source.parent) and not source.is_relative_to(folder):
            used.add(path_of(image).parent)
    names = (f"{saved.stem} images{f' {number}' if number > 1 else ''}" for number in count(1))
    target = next(path for path in (saved.parent / name / layout for name in names) if path not in used) / source.name
    with refused(f"'{target}' can't be written", "free some space or save the file elsewhere"):
        target.parent.mkdir(parents=True, exist_ok=True)
        for tile in tiles_of(source) or [source]:
            shutil.copyfile(tile, target.parent / tile.name)
    return target
