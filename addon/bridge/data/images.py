"""Images: the result folder's EXR files as Blender images, and arrays as generated ones."""

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import bpy
import numpy as np

from ...core.brdf.material import ObjectMaterial
from ...core.errors import BadInputError
from ...core.naming import MAX_LENGTH, cut
from ...core.results.room_file import MATERIALS, layout_of
from ..custom_properties import IMAGE, LAYOUT, UV_MAP
from .mesh_objects import PARTS_UV

RADIANCE = "Linear Rec.709"
"""Colour space of radiance, albedo and F0."""
UDIM = "<UDIM>"
DATA = "Non-Color"
"""Colour space of data that are not colours."""


def load_image(
    path: Path | str, name: str | None = None, colour_space: str = RADIANCE, keep: bool = True
) -> bpy.types.Image:
    """Link an image file of a result folder; it is marked (`custom_properties.IMAGE`) with where it came from.

    Parameters
    ----------
    path : Path or str
        One with ``<UDIM>`` in its name stands for all its tiles. The image's path is absolute (see `relative_to`).
    name : str, optional
        Name of the image in Blender; the file's stem if left out.
    keep : bool
        Give it a fake user, so that it is saved although no material shows it.

    Raises
    ------
    BadInputError
        The file is missing or is no image.
    """
    path = Path(path).absolute()
    tiles = tiles_of(path)
    try:
        image = bpy.data.images.load(str(tiles[0] if tiles else path), check_existing=False)
        if tiles:
            image.source, image.filepath = "TILED", str(path)
            for tile in tiles[1:]:
                image.tiles.new(int(tile.name[len(path.name.split(UDIM)[0]) :][:4]))
    except RuntimeError as error:
        raise BadInputError(f"{path} can't be opened as an image; run the stage that writes it again.") from error
    image.name = name or path.stem
    image.colorspace_settings.name = colour_space
    image.alpha_mode = "NONE"
    image.use_fake_user = keep
    image[IMAGE] = str(path)
    layout = layout_of(result_of(path))
    if layout:
        image[LAYOUT] = layout
    return image


def result_of(path: Path) -> Path:
    """The result folder that an image's file is of: where it lies, or the folder above for an object's own."""
    return path.parent if (path.parent / MATERIALS).is_file() else path.parent.parent


def tiles_of(path: Path) -> list[Path]:
    """The files that a path with ``<UDIM>`` in its name stands for; none for any other."""
    return sorted(path.parent.glob(path.name.replace(UDIM, "[0-9]" * 4))) if UDIM in path.name else []


def load_parts(
    folder: Path, files: dict[int, str], room: str, descriptions: dict[int, ObjectMaterial]
) -> dict[int, bpy.types.Image]:
    """The images of a result folder's `Parts`, by object; objects of one file share its image."""
    images: dict[str, bpy.types.Image] = {}
    for number, file in files.items():
        if file not in images:
            name = image_name(room, "base_color tiles") if UDIM in file else f"{descriptions[number].name} base color"
            images[file] = load_image(folder / file, name, keep=False)
            images[file][UV_MAP] = PARTS_UV
    return {number: images[file] for number, file in files.items()}


def mark_appended(images: Iterable[bpy.types.Image], folder: Path) -> list[bpy.types.Image]:
    """Mark (`custom_properties.IMAGE`) where in a result folder the images of its scene.blend lie; returns them."""
    loaded = [image for image in images if image.source in ("FILE", "TILED") and image.filepath]
    for image in loaded:
        path = Path(image.filepath.replace("\\", "/"))
        is_part = UV_MAP in image and image.source == "FILE"  # an object's, in a folder below the result's
        image[IMAGE] = str(folder / path.parent.name / path.name if is_part else folder / path.name)
    return loaded


def image_name(room: str, path: Path | str) -> str:
    """Blender's name for an image file of a room: 'kitchen base color', to distinguish two rooms in one file."""
    label = Path(path).stem.replace("_", " ")
    return f"{cut(room, MAX_LENGTH - 8) or 'room'} {label}"


def relative_to(image: bpy.types.Image, folder: Path | str) -> None:
    """Give an image a path from the .blend's folder (``//``), so that both can be moved together; not across drives."""
    with suppress(ValueError):  # another drive
        image.filepath = bpy.path.relpath(image.filepath, start=str(Path(folder).absolute())).replace(os.sep, "/")


def array_image(name: str, pixels: np.ndarray, colour_space: str = RADIANCE) -> bpy.types.Image:
    """Make a float image from an array and pack it into the .blend.

    Parameters
    ----------
    pixels : (h, w), (h, w, 3) or (h, w, 4) float
        Row 0 at the bottom; in `colour_space`, `RADIANCE` or `DATA`.
    """
    pixels = np.atleast_3d(pixels)
    height, width, channels = pixels.shape
    image = bpy.data.images.new(name, width, height, float_buffer=True, is_data=colour_space == DATA)
    # The colour space comes first: setting it afterwards would throw the pixels away.
    image.colorspace_settings.name = colour_space
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., : max(channels, 3)] = pixels
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()
    return image


def image_array(image: bpy.types.Image) -> np.ndarray:
    """Pixels of an image, (h, w, 4) float32, row 0 at the bottom."""
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, image.channels)
