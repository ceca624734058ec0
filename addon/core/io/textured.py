"""A mesh with a baked texture and nothing else, as apps on phones export it: the texture is taken for its light.

The weakest of all captures: 8 bits, blended by an app from pictures whose exposures nobody tells, one value for all
views. A folder with cameras is of another format, and its mesh's texture is not looked at.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..scene.model import AUTO
from ..scene.stored_light import LitTexture
from .base_colour import as_file, base_colours
from .formats import FORMATS
from .layout import Layout, Reader, Reading
from .meshes import IMPORTED, find_mesh, mesh_files, read_mesh
from .pictures import picture_size
from .transfer import SRGB


def find(root: Path) -> bool:
    """Whether the folder's only mesh is of a kind that can have a texture, and it is no result that was exported."""
    try:
        meshes = mesh_files(root)
    except OSError:
        return False
    return len(meshes) == 1 and meshes[0].suffix.lower() in IMPORTED and not (root / "materials.json").exists()


def read(root: Path, reading: Reading) -> Layout:
    """Read the mesh and find its texture, as `layout.Reader` has it."""
    path = find_mesh(root, reading)
    if path.suffix.lower() not in IMPORTED:
        raise BadInputError(f"Mesh '{path}' can't have a texture; give a GLB, glTF or OBJ file, or cameras and frames.")
    mesh = read_mesh(path, reading)
    pictures = base_colours(path)
    textures = list(dict.fromkeys(picture for picture in pictures if picture is not None))
    if mesh.material is None or mesh.uv is None or not textures:
        raise BadInputError(
            f"Capture '{root}' has no frames, and its mesh '{path.name}' no texture with coordinates; give it either."
        )
    for picture in textures:
        with as_file(picture) as file:
            try:
                picture_size(file)
            except BadInputError as error:
                what = str(error).replace(str(file), path.name)
                raise BadInputError(f"The texture of '{path}' can't be read: {what}") from error
    numbers = np.array([-1 if picture is None else textures.index(picture) for picture in (*pictures, None)], np.int32)
    texture_of = numbers[np.clip(mesh.material, -1, len(pictures) - 1)]
    if not (texture_of >= 0).any():
        raise BadInputError(f"No triangle of '{path}' shows a texture; export it again, or add cameras and frames.")
    lit = LitTexture(
        tuple(textures), texture_of, mesh.uv, reading.transfer if reading.transfer not in ("", AUTO) else SRGB
    )
    note = (
        "The capture has no cameras: the light is taken from the texture of its mesh. That is weaker than frames: "
        "highlights can't be told, nor what the texture clips, nor what lies outside."
    )
    return Layout([], replace(mesh, lit=lit), notes=[note])


READER = Reader("textured", FORMATS["textured"], find, read)
