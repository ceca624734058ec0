"""A copy of a mesh file that names nothing outside of itself: what Blender's importers are given.

Importers follow what a file names: material libraries, pictures, buffers, wherever they lie. Of a mesh only its surface
is wanted, so the copy has no materials and pictures at all, and its buffers lie beside it.
glTF: registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, sections 3.6 (buffers) and 4.4 (the binary container).
"""

import base64
import binascii
import json
import re
import shutil
import struct
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from ..errors import BadInputError
from ..kinds import Block, Limit
from .files import leads_out
from .gltf_nodes import Placed, is_index, placed_meshes

MAX_JSON: Limit[int] = 1 << 28
"""Bytes of glTF's JSON part that are read at most."""
MAX_BARE: Limit[int] = 1 << 24
"""Elements that an accessor without a buffer may claim: they are zeros that the importer makes up."""
MATERIAL = "material {}"
"""What copies call the materials, which they keep as names alone: by their numbers in the file."""
DROPPED = ("textures", "images", "samplers", "animations", "skins", "cameras", "extensions")
COMPRESSED = "KHR_draco_mesh_compression"
OBJ_DROPPED = re.compile(rb"^\s*(mtllib|usemtl|usemap|maplib|call|csh)\b")
OBJ_MATERIAL = re.compile(rb"^\s*usemtl\s+(.*\S)\s*$")
OBJ_FACE = re.compile(rb"^\s*f\s")
OBJ_PART = re.compile(rb"^([og] )(.*\S)\s*$")
BLOCK: Block[int] = 1 << 20


class Copy(NamedTuple):
    """A copy, and what the file says that it does not.

    Attributes
    ----------
    path : Path
        Of the copy.
    placed : list of Placed
        OBJ: what each part is called: of a thousand of one name Blender takes long to name the next. glTF: where the
        file's nodes have the meshes.
    materials : tuple of str
        Their names, '' for none.
    faces : int
        How many it has; -1 where Blender would give them in another order.
    named : bool
        OBJ: whether it has objects (`o`); else its groups (`g`) are what tells its parts.
    """

    path: Path
    placed: list[Placed]
    materials: tuple[str, ...]
    faces: int
    named: bool = False


def copy_obj(path: Path, folder: Path) -> Copy:
    """Copy the OBJ file `path` into `folder` without what its materials are, its objects or groups called 'part N'.

    Raises
    ------
    OSError
        It can't be read, or the copy not written.
    """
    copy, named, inside, faces, in_order = folder / "mesh.obj", False, False, 0, True
    placed: list[Placed] = []
    materials: dict[bytes, int] = {}
    with open(path, "rb") as source, open(copy, "wb") as target:
        # Lines of bounded length: a file without line ends is no reason to hold all of it.
        while line := source.readline(BLOCK):
            dropped = inside or OBJ_DROPPED.match(line) is not None
            inside = dropped and line.rstrip(b"\r\n").endswith(b"\\")
            named |= line.startswith(b"o ")
            if not dropped and (part := OBJ_PART.match(line)):
                line = part[1] + f"part {len(placed)}\n".encode()
                placed.append(Placed(len(placed), part[2].decode("utf-8", "replace").strip(), np.eye(4), faces))
            elif OBJ_FACE.match(line):
                faces += 1
                corners = [corner.split(b"/")[0] for corner in line.split()[1:]]
                in_order &= len(set(corners)) == len(corners)  # else Blender puts what it makes of it last
            if material := OBJ_MATERIAL.match(line):
                target.write(f"usemtl {MATERIAL}\n".format(materials.setdefault(material[1], len(materials))).encode())
            elif not dropped:
                target.write(line)
    names = tuple(name.decode("utf-8", "replace") for name in materials)
    return Copy(copy, placed, names, faces if in_order else -1, named)


def copy_gltf(path: Path, folder: Path) -> Copy:
    """Copy the glTF or GLB file `path` into `folder`: its meshes, each in a node 'part N' of its own, buffers beside.

    Raises
    ------
    BadInputError
        It is damaged, or names buffers outside of its folder.
    OSError
        It can't be read, or the copy not written.
    """
    top, binary = read_gltf(path)
    if not isinstance(top.get("asset"), dict) or not str(top["asset"].get("version", "")).startswith("2"):
        raise BadInputError(f"Mesh '{path}' is no glTF 2.0; export it again.")
    sizes = []
    for i, buffer in enumerate(list_of(top, "buffers", path)):
        target = folder / f"buffer{i}.bin"
        uri = buffer.get("uri")
        if uri is None:
            if i or binary is None:
                raise BadInputError(f"Mesh '{path}' has a buffer ({i}) without content; export it again.")
            copy_part(path, target, *binary)
        elif isinstance(uri, str) and uri.startswith("data:"):
            _decode(path, uri, target)
        else:
            shutil.copyfile(beside(path, uri, "buffer"), target)
        buffer["uri"] = target.name
        sizes.append(target.stat().st_size)
        if not _count(buffer.get("byteLength")) <= sizes[-1]:
            raise BadInputError(f"Mesh '{path}' has a buffer ({i}) that is cut off; copy or export it again.")
    _check_sizes(top, sizes, path)
    for name in DROPPED:
        top.pop(name, None)
    materials = [material.get("name") for material in list_of(top, "materials", path)]
    count = len(materials)
    top["materials"] = [{"name": MATERIAL.format(i)} for i in range(count)]
    for mesh in list_of(top, "meshes", path):
        for primitive in list_of(mesh, "primitives", path):
            if not is_index(primitive.get("material"), count):
                primitive.pop("material", None)
            extensions = primitive.pop("extensions", None)
            if isinstance(extensions, dict) and COMPRESSED in extensions:
                primitive["extensions"] = {COMPRESSED: extensions[COMPRESSED]}
    meshes = list_of(top, "meshes", path)
    placed = placed_meshes(list_of(top, "nodes", path), len(meshes), path)
    sizes, faces = [_triangles(mesh, top, path) for mesh in meshes], 0
    for i, node in enumerate(placed):
        placed[i] = node._replace(name=node.name or str(meshes[node.mesh].get("name") or ""), first=faces)
        faces += sizes[node.mesh]
    used = sorted({node.mesh for node in placed})
    top["nodes"] = [{"mesh": number, "name": f"part {number}"} for number in used]
    top["scenes"], top["scene"] = [{"nodes": list(range(len(used)))}], 0
    for name in ("extensionsUsed", "extensionsRequired"):
        names = top.get(name, [])
        if not isinstance(names, list):
            raise BadInputError(f"Mesh '{path}' has '{name}' that is no list; export it again.")
        top[name] = [item for item in names if item in (COMPRESSED, "KHR_mesh_quantization")]
        if not top[name]:
            del top[name]
    copy = folder / "mesh.gltf"
    copy.write_text(json.dumps(top))
    return Copy(copy, placed, tuple(name if isinstance(name, str) else "" for name in materials), faces)


def _triangles(mesh: dict[str, Any], top: dict[str, Any], path: Path) -> int:
    """How many triangles a mesh says that it has."""
    accessors, count = list_of(top, "accessors", path), 0
    for primitive in list_of(mesh, "primitives", path):
        attributes, mode = primitive.get("attributes"), primitive.get("mode", 4)
        place: Any = primitive.get("indices", attributes.get("POSITION") if isinstance(attributes, dict) else None)
        corners = int(accessors[place]["count"]) if is_index(place, len(accessors)) else 0
        count += corners // 3 if mode == 4 else max(corners - 2, 0) if mode in (5, 6) else 0
    return count


def read_gltf(path: Path) -> tuple[dict[str, Any], tuple[int, int] | None]:
    """The JSON part, and where the binary part begins and how long it is."""
    with open(path, "rb") as file:
        head = file.read(20)
        binary = None
        if head[:4] == b"glTF":
            if len(head) < 20 or head[16:20] != b"JSON":
                raise BadInputError(f"Mesh '{path}' is damaged or cut off; copy or export it again.")
            length = struct.unpack("<I", head[12:16])[0]
            text = file.read(min(length, MAX_JSON))
            chunk = file.read(8)
            if len(chunk) == 8 and chunk[4:] == b"BIN\0":
                binary = 28 + length, struct.unpack("<I", chunk[:4])[0]
        else:
            text = head + file.read(MAX_JSON)
    try:
        top = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"Mesh '{path}' is no glTF, or damaged; copy or export it again.") from error
    if not isinstance(top, dict):
        raise BadInputError(f"Mesh '{path}' is no glTF; export it again.")
    return top, binary


def list_of(value: dict[str, Any], name: str, path: Path) -> list[dict[str, Any]]:
    """The list of objects `name`, empty where absent."""
    items = value.get(name, [])
    if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        raise BadInputError(f"Mesh '{path}' has '{name}' that are no list of objects; export it again.")
    return items


def _count(value: Any) -> float:
    """A count or size as the file gives it; inf where it is none."""
    return value if isinstance(value, int) and not isinstance(value, bool) and value >= 0 else float("inf")


def beside(path: Path, uri: Any, what: str) -> Path:
    """The file that `uri` names, which has to lie in the folder of `path` or below; `what` it is, for messages."""
    name = unquote(uri) if isinstance(uri, str) else ""
    if not name or "\0" in name or "://" in name or leads_out(name):
        raise BadInputError(
            f"Mesh '{path}' names the {what} {str(uri)[:80]!r}, which does not lie beside it; "
            "export it as one GLB file."
        )
    target = path.parent / name
    try:
        exists = target.is_file()
    except OSError:  # a name that no file can have
        exists = False
    if not exists:
        raise BadInputError(f"Mesh '{path}' names the {what} '{target}', which is not there; copy it as well.")
    if not target.resolve().is_relative_to(path.parent.resolve()):
        raise BadInputError(
            f"Mesh '{path}' names the {what} '{target}', a link out of its folder; copy the file there instead."
        )
    return target


def copy_part(path: Path, target: Path, begin: int, length: int) -> None:
    """Write so many bytes of a file, from `begin` on, to another."""
    with open(path, "rb") as source, open(target, "wb") as file:
        source.seek(begin)
        while length > 0 and (block := source.read(min(length, BLOCK))):
            file.write(block)
            length -= len(block)


def _decode(path: Path, uri: str, target: Path) -> None:
    try:
        target.write_bytes(base64.b64decode(uri.partition(",")[2], validate=True))
    except (binascii.Error, ValueError) as error:
        raise BadInputError(f"Mesh '{path}' has a damaged buffer; export it again.") from error


def _check_sizes(top: dict[str, Any], sizes: list[int], path: Path) -> None:
    """Compare what views and accessors claim with what there is: importers take them at their word."""
    for view in list_of(top, "bufferViews", path):
        buffer: Any = view.get("buffer")
        end = _count(view.get("byteOffset", 0)) + _count(view.get("byteLength"))
        if not is_index(buffer, len(sizes)) or end > sizes[buffer]:
            raise BadInputError(f"Mesh '{path}' points beyond its buffers: it is damaged; export it again.")
    for accessor in list_of(top, "accessors", path):
        if not _count(accessor.get("count")) <= (MAX_BARE if "bufferView" not in accessor else sum(sizes)):
            raise BadInputError(f"Mesh '{path}' claims more values than it holds: it is damaged; export it again.")
