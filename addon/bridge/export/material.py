"""A recovered material in plain Principled terms: numbers, one 8-bit picture over the atlas, one colour of light."""

from itertools import chain, count
from pathlib import Path

import bpy
import numpy as np

from ...core.brdf.compensation import ior_of
from ...core.brdf.model import Principled
from ...core.io.png import write_png
from ...core.kinds import Code
from ...core.photo import encoded
from ..custom_properties import IMAGE, UV_MAP
from ..data.images import UDIM, image_array, load_image
from ..data.materials import (
    ALPHA,
    BASE_COLOR,
    EMISSION_COLOR,
    IOR,
    METALLIC,
    REPEATS,
    ROUGHNESS,
    SPECULAR_LEVEL,
    emission,
    plain_material,
    principled,
)
from ..data.names import split_number
from ..data.nodes import image_node
from ..light import lamps

WHOLE = "base_color.exr"
"""The room's one image, beside its tiles."""
FIRST_TILE: Code[int] = 1001


def plain_copy(
    material: bpy.types.Material, textures: Path, pictures: dict, level: bool, tiles: frozenset[int]
) -> bpy.types.Material:
    """A material that exporters understand.

    Parameters
    ----------
    material : bpy.types.Material
        What it shows is read off its Principled node; one without such a node becomes grey.
    textures : Path
        Folder for the 8-bit pictures.
    pictures : dict
        Those that were made already, by the image they show (and its tile); filled here.
    level : bool
        The format holds Specular IOR Level; else F0, which that level scales, goes into the index of refraction.
    tiles : frozenset of int
        UDIM tiles that the material's object lies on. One becomes a picture that repeats; for an object on several, the
        room's one image is taken.

    Returns
    -------
    bpy.types.Material
        Culled from behind where the original shines on one side only: glTF then has it single-sided.
    """
    shader = principled(material)
    if shader is None:
        return plain_material(material.name, Principled(specular_level=0.5))
    inputs = shader.inputs
    node = image_node(inputs[BASE_COLOR])
    image = node.image if node else None
    ior, specular = inputs[IOR].default_value, inputs[SPECULAR_LEVEL].default_value
    if not level:
        ior, specular = ior_of(2 * specular * ((ior - 1) / (ior + 1)) ** 2), 0.5
    elif specular == 0.5:
        # Blender's glTF exporter writes an index of refraction only beside a specular factor that is not 1.
        specular = 0.49999
    colour = tuple(inputs[BASE_COLOR].default_value[:3])
    roughness, metallic, alpha = (inputs[name].default_value for name in (ROUGHNESS, METALLIC, ALPHA))
    values = Principled(colour, roughness, metallic, ior, specular, alpha, emission(material))
    picture = None if image is None else _picture(*_one_tile(image, tiles), textures, pictures)
    copy = plain_material(material.name, values, picture)
    copy.use_backface_culling = bool(inputs[EMISSION_COLOR].links) and lamps.is_lamp(material)
    return copy


def _one_tile(image: bpy.types.Image, tiles: frozenset[int]) -> tuple[bpy.types.Image, int]:
    """For formats without tiles: a tiled image and the number of one tile, or the room's image and 0."""
    if image.source != "TILED":
        return image, 0
    if len(tiles) == 1:
        return image, next(iter(tiles))
    path = Path(bpy.path.abspath(image.filepath)).parent / WHOLE
    for whole in bpy.data.images:
        if whole.source == "FILE" and UV_MAP not in whole:
            if whole.get(IMAGE) == str(path) or Path(bpy.path.abspath(whole.filepath)) == path:
                return whole, 0
    return image, min(tiles, default=FIRST_TILE)


def _pixels(image: bpy.types.Image, tile: int, textures: Path) -> np.ndarray:
    """The pixels of an image or of one of its tiles, (h, w, c) float32."""
    if not tile:
        return image_array(image)
    path = Path(bpy.path.abspath(image.filepath.replace(UDIM, str(tile))))
    packed = next((file for file in image.packed_files if str(tile) in Path(file.filepath).name), None)
    if packed is not None:
        path = textures.with_name(f"tile{path.suffix}")
        path.write_bytes(packed.packed_file.data)
    tile_image = load_image(path, colour_space=image.colorspace_settings.name, keep=False)
    try:
        return image_array(tile_image)
    finally:
        bpy.data.images.remove(tile_image)
        if packed is not None:
            path.unlink()


def _file_name(image: bpy.types.Image, textures: Path) -> str:
    """A name that the folder does not hold yet, whatever the case."""
    taken = {path.stem.casefold() for path in textures.iterdir()}
    plain = bpy.path.clean_name(split_number(image.name)[0])
    names = chain([plain], (f"{plain}_{number}" for number in count(2)))
    return next(name for name in names if name.casefold() not in taken)


def _picture(image: bpy.types.Image, tile: int, textures: Path, pictures: dict) -> bpy.types.Image:
    """An image as PNG of 8 bits in sRGB, which glTF and USD's preview surface take."""
    if (image, tile) in pictures:
        return pictures[image, tile]
    if not all(image.size):
        return image
    pixels = _pixels(image, tile, textures)[::-1, :, :3]
    linear = image.colorspace_settings.name != "sRGB" or image.is_float
    path = textures / f"{_file_name(image, textures)}{f'_{tile}' if tile else ''}.png"
    write_png(path, np.ascontiguousarray(encoded(pixels) if linear else (pixels * 255 + 0.5).astype(np.uint8)))
    picture = bpy.data.images.load(str(path))
    picture.colorspace_settings.name = "sRGB"
    if UV_MAP in image:
        picture[UV_MAP] = image[UV_MAP]
    picture[REPEATS] = bool(tile)
    pictures[image, tile] = picture
    return picture
