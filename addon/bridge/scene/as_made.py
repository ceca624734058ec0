"""What a room was when it was made, kept with its data, so that an artist's edits are told from a run's own values.

All of it are custom properties: they are saved with the file and need no registered add-on.
"""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from mathutils import Matrix

from ..data.arrays import faces_of, vertices_of
from ..data.materials import MODEL
from ..data.mesh_objects import ATLAS_UV, CAPTURE_UV
from ..data.names import split_number
from ..light import lamps, outside

NAME = "scan_relight_name"
"""Of an object: the name that it was made with."""
PLACE = "scan_relight_place"
"""Of an object: its own matrix (`matrix_basis`, row by row) when it was made."""
SHAPE = "scan_relight_shape"
"""Of a mesh: digest of its vertices and faces when it was made."""
WRITTEN = "scan_relight_written"
"""Of a material or world: its nodes' values and links when it was made, as JSON; no digest, as another version of
Blender may add sockets."""
_BUILT_IN = {"position", "sharp_face", "sharp_edge", "material_index", ATLAS_UV, CAPTURE_UV}


def stamp(thing: bpy.types.Object, name: str | None = None) -> None:
    """Note what an object and its data are; what was noted before stays."""
    if NAME not in thing:
        thing[NAME] = name or thing.name
    if PLACE not in thing:
        thing[PLACE] = [value for row in thing.matrix_basis for value in row]
    if thing.type == "MESH":
        if SHAPE not in thing.data:
            thing.data[SHAPE] = shape(thing.data)
        for slot in thing.material_slots:
            if slot.material is not None:
                stamp_tree(slot.material)


def stamp_tree(owner: bpy.types.Material | bpy.types.World, anew: bool = False) -> None:
    """Note what a recovered material or world is; `anew` where it was made again in place."""
    if anew or WRITTEN not in owner:
        owner[WRITTEN] = json.dumps(_values(owner))


def is_renamed(thing: bpy.types.Object) -> bool:
    """Whether the artist gave an object another name."""
    return split_number(thing.name)[0] != split_number(thing.get(NAME, ""))[0]


def made_at(thing: bpy.types.Object) -> Matrix:
    """The own matrix that an object was made with."""
    kept = list(thing[PLACE])
    return Matrix([kept[k : k + 4] for k in range(0, 16, 4)])


def shape(data: bpy.types.Mesh) -> str:
    """Digest of a mesh's vertices and faces."""
    starts, corners = faces_of(data)
    digest = hashlib.sha1(usedforsecurity=False)
    for values in (vertices_of(data), corners, starts[:-1]):
        digest.update(values.tobytes())
    return digest.hexdigest()


def is_edited(thing: bpy.types.Object) -> bool:
    """Whether an object has another mesh than the one it was made with, or one with the artist's data on it."""
    data = thing.data
    added = any(not layer.name.startswith(".") and layer.name not in _BUILT_IN for layer in data.attributes)
    return added or data.shape_keys is not None or len(data.materials) > 1 or data.get(SHAPE) != shape(data)


def is_corrected(owner: bpy.types.Material | bpy.types.World) -> bool:
    """Whether the nodes of a recovered material or world differ from what was written, but for the light's state."""
    kept = owner.get(WRITTEN)
    if kept is None:
        return False
    now, made = _values(owner), json.loads(kept)
    nodes = {key.partition("\n")[0] for key in now}
    for key in _state(owner):
        made.pop(key, None)
    # A socket that is gone from a node that is there went with a version of Blender.
    return any(key.partition("\n")[0] not in nodes or key in now and now[key] != value for key, value in made.items())


@contextmanager
def our_own(owner: bpy.types.Material | bpy.types.World) -> Iterator[None]:
    """What is changed within is shown on the artist's behalf: `is_corrected` says afterwards what it said before."""
    noted = WRITTEN in owner and not is_corrected(owner)
    yield
    if noted:
        del owner[WRITTEN]
        stamp_tree(owner)


def is_ours(material: bpy.types.Material | None) -> bool:
    """Whether a material was recovered."""
    return material is not None and MODEL in material


def _state(owner) -> set[str]:
    """Keys of the values that show whether a light is on, how strong and how coloured."""
    sockets = (lamps if isinstance(owner, bpy.types.Material) else outside).state_sockets(owner)
    return {_key(socket.node, socket) for socket in sockets}


def _key(node, socket) -> str:
    return f"{node.name}\n{socket.identifier}"


def _values(owner) -> dict[str, object]:
    """Each input of each node: where its link comes from, else its value; and each node's picture."""
    found: dict[str, object] = {}
    for node in owner.node_tree.nodes if owner.node_tree else ():
        found[f"{node.name}\n"] = [node.bl_idname, node.mute]
        if getattr(node, "image", None) is not None:
            found[f"{node.name}\nimage"] = bpy.path.basename(node.image.filepath)
        for socket in node.inputs:
            if socket.links:
                source = socket.links[0]
                found[_key(node, socket)] = [source.from_node.name, source.from_socket.identifier]
            elif socket.type in ("VALUE", "INT", "BOOLEAN", "RGBA", "VECTOR"):
                found[_key(node, socket)] = _plain(socket.default_value)
    return found


def _plain(value):
    if isinstance(value, (bool, int)):
        return value
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return [float(f"{one:.6g}") for one in value]
