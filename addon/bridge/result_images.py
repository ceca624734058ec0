"""A result folder's images in the open file: referred to, copied beside the file, or packed into it."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

import bpy

from ..core.errors import BadInputError, StorageError
from .images import DATA, RADIANCE, load_image, relative_to
from .scene import ALBEDO, BASE_COLOR, SHADING

RESULT, FOLDER, PACK = "RESULT", "FOLDER", "PACK"
"""Refer to the result folder; copy into a folder beside the saved .blend; pack into it."""
MARK = "scan_relight_image"
"""Custom property of an image: the file of the result folder that it came from."""
COLOUR_SPACES = {BASE_COLOR: RADIANCE, ALBEDO: RADIANCE, SHADING: RADIANCE, "lit_diffuse.exr": RADIANCE,
                 "coverage.exr": DATA, "albedo_error.exr": DATA, "evidence.exr": DATA}
BAKED = (BASE_COLOR, ALBEDO, SHADING)


def bring(folder: Path | str, where: str = RESULT) -> bpy.types.Image | None:
    """Load the baked images (`BAKED`); what an earlier call loaded of this folder is taken again and renewed.

    Returns
    -------
    bpy.types.Image or None
        The one that Base Color shows.

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


def image(folder: Path | str, name: str, where: str = RESULT, keep: bool = True,
          share: bool = False) -> bpy.types.Image:
    """One image of a result folder, with the colour space that its content asks for; raises as `bring`.

    `keep` gives it a fake user; with `share` one that is there already is read again.
    """
    source = Path(folder).absolute() / name
    earlier = next((one for one in bpy.data.images if one.get(MARK) == str(source) and not one.library), None)
    if share and earlier is not None:
        if not earlier.packed_file:
            earlier.reload()
        return earlier
    path = source if where != FOLDER else _beside(source)
    loaded = load_image(path, colour_space=COLOUR_SPACES[name], packed=where == PACK, keep=keep)
    loaded[MARK] = str(source)
    if earlier is not None:
        label = earlier.name
        earlier.user_remap(loaded)
        bpy.data.images.remove(earlier)
        loaded.name = label
    if where != PACK and bpy.data.filepath:
        relative_to(loaded, Path(bpy.data.filepath).parent)
    return loaded


def drop_unused(folders: Iterable[str]) -> None:
    """Remove the images of result folders other than `folders` that nothing shows."""
    for one in list(bpy.data.images):
        source = one.get(MARK)
        if source and str(Path(source).parent) not in folders and one.users == int(one.use_fake_user):
            bpy.data.images.remove(one)


def _beside(source: Path) -> Path:
    """A copy of `source` in the folder of images beside the saved file."""
    if not bpy.data.filepath:
        raise BadInputError("Images can't go beside a file that was never saved; save it first, or pack them.")
    saved = Path(bpy.data.filepath)
    target = saved.parent / f"{saved.stem} images" / source.name
    try:
        target.parent.mkdir(exist_ok=True)
        shutil.copyfile(source, target)
    except OSError as error:
        raise StorageError(f"'{target}' can't be written ({error.strerror or error}); free some space or save the file "
                           "elsewhere.") from error
    return target
