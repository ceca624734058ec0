"""OBJ, glTF and GLB through Blender's importers."""

from __future__ import annotations

import base64
import json

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


def centres(mesh):
    return mesh.vertices[mesh.triangles].mean(1)


@pytest.mark.parametrize("letter", ["o", "g"])
def test_triangles_of_an_obj_know_their_face_in_the_file(tmp_path, letter):
    """Parts in no alphabetical order, one of them none's; quads, a pentagon and triangles, at x = their number."""
    shapes, lines = [3, 4, 5, 3, 4, 3], ["v 0 0 9"]
    for i, count in enumerate(shapes):
        lines += [f"{letter} {'zebra' if i < 3 else 'ant'}{i}"] * (i in (1, 3, 5))
        angles = np.arange(count) * 2 * np.pi / count
        lines += [f"v {i} {np.cos(a):.6f} {np.sin(a):.6f}" for a in angles]
        lines.append("f " + " ".join(str(k - count) for k in range(count)))
    path = tmp_path / "a.obj"
    path.write_text("\n".join(lines) + "\n")
    mesh = import_mesh(path)
    assert mesh.faces.total == 6 and not mesh.faces.own_vertices
    assert mesh.faces.of_triangle.tolist() == np.rint(centres(mesh)[:, 0]).tolist()
    assert len(mesh.triangles) == sum(shapes) - 12


@pytest.mark.parametrize("odd", ["f 1 2 2 3", "f 1 2", "f 1 1 1"])
def test_an_obj_whose_faces_blender_changes_has_no_order(tmp_path, odd):
    path = tmp_path / "a.obj"
    path.write_text(f"{QUAD}f 1 2 3\n{odd}\nf 1 2 3 4\nf 2 3 4\n")
    assert import_mesh(path).faces.total == -1


def test_names_of_materials_are_kept(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(f"mtllib no.mtl\n{QUAD}usemtl dark oak\nf 1 2 3\nusemtl steel\nf 2 3 4\nusemtl dark oak\nf 1 3 4\n")
    mesh = import_mesh(path)
    assert mesh.material_names == ("dark oak", "steel") and mesh.material.tolist() == [0, 1, 0]


def test_triangles_of_a_gltf_are_counted_node_by_node(tmp_path):
    """Two nodes of one mesh around another, whose names come in another order; two primitives, one a fan."""
    corners = np.array([(x, y, 0) for x in range(3) for y in range(2)], np.float32)
    index = np.array([0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5, 0, 1, 3, 2], np.uint16)
    data = corners.tobytes() + index.tobytes()
    count = {"bufferView": 1, "componentType": 5123, "type": "SCALAR"}
    top = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [{"mesh": 0, "name": "zebra"}, {"mesh": 1, "name": "ant", "translation": [0, 0, 5]},
                  {"mesh": 0, "name": "bee", "translation": [0, 0, 9]}],
        "materials": [{"name": "wood"}, {}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 1},
                                   {"attributes": {"POSITION": 0}, "indices": 2, "material": 0}]},
                   {"primitives": [{"attributes": {"POSITION": 0}, "indices": 3, "mode": 6}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3",
                       "min": [0, 0, 0], "max": [2, 1, 0]},
                      count | {"count": 9}, count | {"count": 3, "byteOffset": 18},
                      count | {"count": 4, "byteOffset": 24}],
        "bufferViews": [{"buffer": 0, "byteLength": corners.nbytes},
                        {"buffer": 0, "byteOffset": corners.nbytes, "byteLength": index.nbytes}],
        "buffers": [{"uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
                     "byteLength": len(data)}],
    }  # fmt: skip
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(top))
    mesh = import_mesh(path)
    own = {mesh.names[i]: mesh.faces.of_triangle[mesh.object_id == i].tolist() for i in mesh.names}
    assert own == {"ant": [4, 5], "bee": [6, 7, 8, 9], "zebra": [0, 1, 2, 3]} and mesh.faces.total == 10
    assert mesh.material_names == ("wood", "")
    assert mesh.material[mesh.object_id == 2].tolist() == [1, 1, 1, 0]
