"""Two runs write scenes that hold the same, though Blender's files of them are never equal byte by byte."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hostile.kills import OPTIONS
from tests.hostile.load import boxes, write

bpy = pytest.importorskip("bpy")

KINDS = ("scenes", "collections", "objects", "meshes", "materials", "worlds", "cameras", "images", "actions")
LEFT_OUT = {"session_uid", "identifier", "filepath", "filepath_raw", "use_nodes"}
"""What Blender counts or draws by chance, where the result lies, and what Blender 6 won't have."""


def plain(value):
    return tuple(map(plain, value)) if hasattr(value, "__len__") and not isinstance(value, (str, set)) else value


def values(thing) -> dict:
    """All that is no reference to other things, by name."""
    kinds = {one.identifier: one.type for one in thing.bl_rna.properties}
    names = [name for name, kind in kinds.items() if kind not in ("POINTER", "COLLECTION") and name not in LEFT_OUT]
    return {name: plain(getattr(thing, name)) for name in names}


def of_tree(tree) -> list:
    inputs = [(one.name, [values(socket) for socket in one.inputs]) for one in tree.nodes]
    links = [(one.from_node.name, one.from_socket.name, one.to_node.name, one.to_socket.name) for one in tree.links]
    return [[values(one) for one in tree.nodes], inputs, links]


def of_mesh(mesh) -> list[bytes]:
    found = []
    for items, name, width, kind in (
        (mesh.vertices, "co", 3, np.float32),
        (mesh.loops, "vertex_index", 1, np.int32),
        *((layer.uv, "vector", 2, np.float32) for layer in mesh.uv_layers),
    ):
        array = np.empty(len(items) * width, kind)
        items.foreach_get(name, array)
        found.append(array.tobytes())
    return found


def told(path) -> dict:
    """What a file holds, by kind and name."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    result = {(kind, one.name): [values(one)] for kind in KINDS for one in getattr(bpy.data, kind)}
    for mesh in bpy.data.meshes:
        result["meshes", mesh.name] += of_mesh(mesh)
    for one in (*bpy.data.materials, *bpy.data.worlds):
        result[one.bl_rna.identifier, one.name] = of_tree(one.node_tree) if one.node_tree else []
    return result


@pytest.mark.slow
def test_two_runs_write_scenes_that_hold_the_same(package, tmp_path):
    from addon.cli import main

    capture = write(tmp_path / "capture", boxes(4), 8, (48, 36), uv=True)
    options = [one for one in OPTIONS if one not in ("--no-scene", "--unwrap", "own")]
    first, second = (tmp_path / name for name in ("first", "second"))
    for out in (first, second):
        assert main(["recover", str(capture), "--out", str(out), *options]) == 0
    assert (first / "materials.json").read_bytes() == (second / "materials.json").read_bytes()
    known = told(first / "scene.blend")
    assert known == told(second / "scene.blend") and len(known) > 20
