"""OBJ, glTF and GLB through Blender's importers."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.bridge.data.added import KINDS
from addon.bridge.data.import_mesh import import_mesh
from addon.core.errors import BadInputError

QUAD = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 3\n"


def counts():
    return {kind: len(getattr(bpy.data, kind)) for kind in KINDS}


def volume(mesh, i):
    a, b, c = (mesh.vertices[mesh.triangles[mesh.object_id == i][:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("letter", ["o", "g"])
def test_an_obj_keeps_its_coordinates_and_its_parts(tmp_path, letter):
    path = tmp_path / "a.obj"
    path.write_text(
        f"mtllib no.mtl\n{letter} chair\n{QUAD}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl wood\n"
        f"f 1/1 2/2 3/3 4/4\n{letter} table\nv 5 5 5\nv 6 5 5\nv 5 6 5\nf 5 6 7\n"
    )
    before, scene = counts(), bpy.context.scene
    mesh = import_mesh(path)
    assert mesh.names == {0: "chair", 1: "table"} and mesh.object_id.tolist() == [0, 0, 1]
    corners = mesh.vertices[mesh.triangles]
    assert set(map(tuple, corners[:2].reshape(-1, 3).tolist())) == {(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 3)}
    assert corners[2].tolist() == [[5, 5, 5], [6, 5, 5], [5, 6, 5]]
    assert mesh.uv.shape == (3, 3, 2) and mesh.uv[:2].max() == 1
    assert counts() == before and bpy.context.scene == scene


def test_one_object_tells_nothing(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(QUAD + "f 1 2 3 4\n")
    assert import_mesh(path).object_id is None


def test_what_is_open_does_not_change_the_names(tmp_path):
    for name in ("chair", "chair.001"):
        bpy.data.objects.new(name, None)
    path = tmp_path / "a.obj"
    path.write_text(f"o chair\n{QUAD}f 1 2 3\no lamp\nf 2 3 4\no chair\nv 9 9 9\nf 1 2 5\n")
    assert import_mesh(path).names == {0: "chair", 1: "chair", 2: "lamp"}


@pytest.mark.parametrize("kind", ["GLB", "GLTF_SEPARATE"])
def test_gltf_stands_upright_and_mirrored_objects_keep_their_outside(tmp_path, kind):
    bpy.ops.object.select_all(action="DESELECT")
    cube = bpy.data.meshes.new("cube")
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    cube.from_pydata(corners, [], [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    parent, child = bpy.data.objects.new("box", cube), bpy.data.objects.new("lid", cube)
    for thing in (parent, child):
        bpy.context.scene.collection.objects.link(thing)
    parent.location, parent.scale, parent.rotation_euler = (1, 2, 3), (-1, 1, 2), (0.1, 0.2, 0.3)
    child.parent, child.location = parent, (0, 0, 4)
    bpy.context.view_layer.update()
    wanted = [np.array([one.matrix_world @ v.co for v in cube.vertices]) for one in (parent, child)]
    for thing in (parent, child):
        thing.select_set(True)
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "a"), use_selection=True, export_format=kind)
    before = counts()
    mesh = import_mesh(next(p for p in tmp_path.iterdir() if p.suffix in (".glb", ".gltf")))
    assert mesh.names == {0: "box", 1: "lid"} and counts() == before
    for i, corners in enumerate(wanted):
        own = mesh.vertices[mesh.triangles[mesh.object_id == i].ravel()]
        assert np.allclose([own.min(0), own.max(0)], [corners.min(0), corners.max(0)], atol=1e-5)
        assert volume(mesh, i) == pytest.approx(2, abs=1e-4)


@pytest.mark.parametrize(
    "name, content",
    [
        ("a.obj", b""),
        ("a.obj", b"\xff\xfe\x00garbage" * 50),
        ("a.obj", b"v 0 0 0\nf 1 2 99\n"),
        ("a.obj", b"v nan nan nan\nv 1 0 0\n"),
        ("a.glb", b"glTF\x02\0\0\0"),
        ("a.gltf", b"{}"),
        ("a.gltf", b'{"asset": {"version": "2.0"}}'),
        ("a.gltf", b'{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 7}]}'),
        ("a.gltf", b'{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}]}'),
    ],
)
def test_a_broken_file_is_one_sentence(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    before = counts()
    with pytest.raises(BadInputError, match="Mesh '.*'"):
        import_mesh(tmp_path / name)
    assert counts() == before


def test_an_absent_file_is_one_sentence(tmp_path):
    with pytest.raises(BadInputError, match="does not exist"):
        import_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_a_mesh_that_is_being_edited_stays_so(scene, tmp_path, kind):
    mesh = bpy.data.meshes.new("mine")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    mine = bpy.data.objects.new("mine", mesh)
    scene.collection.objects.link(mine)
    bpy.context.view_layer.objects.active = mine
    mine.select_set(True)
    path = tmp_path / f"a.{kind}"
    if kind == "glb":
        bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True, export_format="GLB")
    else:
        path.write_text(QUAD + "f 1 2 3 4\n")
    bpy.ops.object.mode_set(mode="EDIT")
    assert len(import_mesh(path).triangles) == (1 if kind == "glb" else 2)
    assert mine.mode == "EDIT" and mine.select_get()
    assert bpy.context.view_layer.objects.active == mine and len(scene.collection.all_objects) == 1
    bpy.ops.object.mode_set(mode="OBJECT")
