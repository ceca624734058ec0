"""Which pictures a glTF or OBJ file gives the base colours of its materials; of them nothing is looked at here.

glTF 2.0, sections 3.8 (textures), 3.9.2 (base colour) and 5.19 (its coordinates). OBJ's materials: `map_Kd` of MTL.
"""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import BadInputError
from ..kinds import Limit
from ..scene.stored_light import StoredPicture
from .files import read_bytes, readable
from .gltf_nodes import is_index
from .self_contained import BLOCK, OBJ_MATERIAL, beside, copy_part, list_of, read_gltf

MAX_MTL: Limit[int] = 1 << 24
"""Bytes of an OBJ file's material libraries."""
LIBRARY = re.compile(rb"^\s*mtllib\s+(.*\S)\s*$")
NEW, PICTURE = re.compile(rb"^\s*newmtl\s+(.*\S)\s*$"), re.compile(rb"^\s*map_Kd\s+(.*\S)\s*$", re.IGNORECASE)


def base_colours(path: Path) -> list[StoredPicture | None]:
    """The picture of each material of the mesh `path`, as `RawMesh.material` counts them; None where it has none.

    Raises `BadInputError` where the file is damaged, or names a picture that is not beside it.
    """
    return _of_obj(path) if path.suffix.lower() == ".obj" else _of_gltf(path)


@contextmanager
def as_file(picture: StoredPicture) -> Iterator[Path]:
    """A picture as a file of its own, which goes again where it lies within another.

    Raises `BadInputError` where the file that holds it was taken away.
    """
    if not picture.length:
        yield picture.path
        return
    with tempfile.TemporaryDirectory(prefix="scan_relight_") as folder:
        part = Path(folder) / f"texture of {picture.path.name}"
        try:
            copy_part(picture.path, part, picture.begin, picture.length)
        except OSError as error:
            raise BadInputError(f"Texture '{picture.path}' changed during the run; start again.") from error
        yield part


def _of_gltf(path: Path) -> list[StoredPicture | None]:
    top, binary = read_gltf(path)
    textures, images = list_of(top, "textures", path), list_of(top, "images", path)
    views, buffers = list_of(top, "bufferViews", path), list_of(top, "buffers", path)

    def apart(uri: Any, what: str) -> Path:
        if str(uri).startswith("data:"):
            raise BadInputError(f"Mesh '{path}' has its textures written out as text; export it as one GLB file.")
        return beside(path, uri, what)

    def picture(material: dict[str, Any]) -> StoredPicture | None:
        surface = material.get("pbrMetallicRoughness")
        used = surface.get("baseColorTexture") if isinstance(surface, dict) else None
        if not isinstance(used, dict) or used.get("texCoord", 0) != 0:
            return None
        if not is_index(used.get("index"), len(textures)):
            raise damaged
        source = textures[used["index"]].get("source")
        if source is None:  # of an extension: Basis, WebP
            raise BadInputError(f"Mesh '{path}' has textures that are neither PNG nor JPEG; export it with those.")
        if not is_index(source, len(images)):
            raise damaged
        image = images[source]
        if "bufferView" not in image:
            return StoredPicture(apart(image.get("uri"), "texture"))
        if not is_index(image["bufferView"], len(views)):
            raise damaged
        view = views[image["bufferView"]]
        begin, length, buffer = view.get("byteOffset", 0), view.get("byteLength"), view.get("buffer")
        sound = is_index(begin, 1 << 40) and is_index(length, 1 << 40) and length and is_index(buffer, len(buffers))
        if not sound or (binary is None and "uri" not in buffers[buffer]):
            raise damaged
        if "uri" in buffers[buffer]:
            return StoredPicture(apart(buffers[buffer]["uri"], "buffer"), begin, length)
        assert binary is not None
        if begin + length > binary[1]:
            raise damaged
        return StoredPicture(path, binary[0] + begin, length)

    damaged = BadInputError(f"Mesh '{path}' points to a texture that it does not hold; copy or export it again.")
    return [picture(material) for material in list_of(top, "materials", path)]


def _of_obj(path: Path) -> list[StoredPicture | None]:
    used: dict[bytes, None] = {}
    libraries: list[bytes] = []
    with readable(f"Mesh '{path}'", "check its rights"), open(path, "rb") as file:
        while line := file.readline(BLOCK):
            if match := OBJ_MATERIAL.match(line):
                used[match[1]] = None
            elif match := LIBRARY.match(line):
                libraries.append(match[1])
    pictures: dict[bytes, StoredPicture] = {}
    for library in dict.fromkeys(libraries):
        name = b""
        file_of = beside(path, library.decode("utf-8", "replace"), "material library")
        for line in read_bytes(file_of, max_bytes=MAX_MTL).splitlines():
            if match := NEW.match(line):
                name = match[1]
            elif name in used and (match := PICTURE.match(line)):
                # Options come before the name, which alone may hold spaces.
                text = match[1].decode("utf-8", "replace")
                text = text.split()[-1] if text.startswith("-") else text
                pictures[name] = StoredPicture(beside(path, text.replace("\\", "/"), "texture"))
    return [pictures.get(name) for name in used]
