"""The state of a room when it was made, kept with its data, to distinguish an artist's edits from a run's values.

All of it is in custom properties, which are saved with the file and need no registered add-on.
"""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from mathutils import Matrix

from ..custom_properties import OBJECT_ID
from ..data.arrays import faces_of, vertices_of
from ..data.materials import MODEL
from ..data.mesh_objects import ATLAS_UV, CAPTURE_UV, FAR
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
_BUILT_IN = {"position", "sharp_face", "sharp_edge", "material_index", ATLAS_UV, CAPTURE_UV, FAR}


def stamp(obj: bpy.types.Object, name: str | None = None) -> None:
    """Note the state of an object and its data; what was noted before stays."""
    if NAME not in obj:
        obj[NAME] = name or obj.name
    if PLACE not in obj:
        obj[PLACE] = [value for row in obj.matrix_basis for value in row]
    if obj.type == "MESH":
        if SHAPE not in obj.data:
            obj.data[SHAPE] = shape(obj.data)
        for slot in obj.material_slots:
            if slot.material is not None:
                stamp_tree(slot.material)


def stamp_tree(owner: bpy.types.Material | bpy.types.World, anew: bool = False) -> None:
    """Note the state of a recovered material or world; `anew` where it was made again in place."""
    if anew or WRITTEN not in owner:
        owner[WRITTEN] = json.dumps(_values(owner))


def is_renamed(obj: bpy.types.Object) -> bool:
    """Whether the artist gave an object another name."""
    return split_number(obj.name)[0] != split_number(obj.get(NAME, ""))[0]


def made_at(obj: bpy.types.Object) -> Matrix:
    """The `matrix_basis` that an object was made with."""
    values = list(obj[PLACE])
    return Matrix([values[k : k + 4] for k in range(0, 16, 4)])


def shape(data: bpy.types.Mesh) -> str:
    """Digest of a mesh's vertices and faces."""
    starts, corners = faces_of(data)
    digest = hashlib.sha1(usedforsecurity=False)
    for values in (vertices_of(data), corners, starts[:-1]):
        digest.update(values.tobytes())
    return digest.hexdigest()


def is_edited(obj: bpy.types.Object) -> bool:
    """Whether an object has another mesh than the one it was made with, or one with the artist's data on it."""
    data = obj.data
    own_slots = [material for material in data.materials if material is None or OBJECT_ID not in material]
    added = any(not layer.name.startswith(".") and layer.name not in _BUILT_IN for layer in data.attributes)
    return added or data.shape_keys is not None or len(own_slots) > 1 or data.get(SHAPE) != shape(data)


def is_corrected(owner: bpy.types.Material | bpy.types.World) -> bool:
    """Whether the nodes of a recovered material or world differ from what was written, but for the light's state."""
    written = owner.get(WRITTEN)
    if written is None:
        return False
    current, original = _values(owner), json.loads(written)
    nodes, state = {key.partition("\n")[0] for key in current}, _state(owner)
    # If the node is there but not the socket, another version of Blender removed it.
    return any(
        key.partition("\n")[0] not in nodes or current.get(key, value) != value
        for key, value in original.items()
        if key not in state
    )


@contextmanager
def our_own(owner: bpy.types.Material | bpy.types.World) -> Iterator[None]:
    """Changes within are ours, not the artist's: `is_corrected` gives the same afterwards as before."""
    noted = WRITTEN in owner and not is_corrected(owner)
    yield
    if noted:
        stamp_tree(owner, anew=True)


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
    values: dict[str, object] = {}
    for node in owner.node_tree.nodes if owner.node_tree else ():
        values[f"{node.name}\n"] = [node.bl_idname, node.mute]
        if getattr(node, "image", None) is not None:
            values[f"{node.name}\nimage"] = bpy.path.basename(node.image.filepath)
        for socket in node.inputs:
            if socket.links:
                source = socket.links[0]
                values[_key(node, socket)] = [source.from_node.name, source.from_socket.identifier]
            elif socket.type in ("VALUE", "INT", "BOOLEAN", "RGBA", "VECTOR"):
                values[_key(node, socket)] = _plain(socket.default_value)
    return values


def _plain(value):
    if isinstance(value, (bool, int)):
        return value
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return [float(f"{x:.6g}") for x in value]
