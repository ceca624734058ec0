"""Copies of mesh files name nothing else, and what a damaged or hostile one claims is found before it is used."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.gltf_nodes import placed_meshes
from addon.core.io.self_contained import copy_gltf, copy_obj


def gltf(**changes):
    return {"asset": {"version": "2.0"}, "buffers": [{"uri": "mesh.bin", "byteLength": 12}],
            "bufferViews": [{"buffer": 0, "byteLength": 12}], "accessors": [{"bufferView": 0, "count": 1}],
            "images": [{"uri": "/etc/passwd"}], "materials": [{}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}], "nodes": [{"mesh": 0}],
            **changes}  # fmt: skip


def test_an_obj_loses_its_libraries(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib ../one.mtl \\\n ../two.mtl\no chair\nv 0 0 0\n  usemtl wood\ncall x.obj\n")
    (tmp_path / "copy").mkdir()
    copy = copy_obj(tmp_path / "a.obj", tmp_path / "copy")
    text = "o part 0\nv 0 0 0\nusemtl material 0\n"
    assert copy.named and copy.path.read_text() == text and [one.name for one in copy.placed] == ["chair"]
    assert copy.materials == ("wood",)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path):
    """A stranger's capture must not have a file from elsewhere on the disk copied and read."""
    room, private = tmp_path / "room", tmp_path / "private.bin"
    room.mkdir()
    (tmp_path / "copy").mkdir()
    private.write_bytes(b"A" * 12)
    (room / "mesh.gltf").write_text(json.dumps(gltf()))
    (room / "mesh.bin").symlink_to(private)
    with pytest.raises(BadInputError, match=r"mesh\.bin', a link out of"):
        copy_gltf(room / "mesh.gltf", tmp_path / "copy")
    (room / "mesh.bin").unlink()
    (room / "inner.bin").write_bytes(b"A" * 12)
    (room / "mesh.bin").symlink_to("inner.bin")
    copy_gltf(room / "mesh.gltf", tmp_path / "copy")
    assert (tmp_path / "copy/buffer0.bin").read_bytes() == b"A" * 12


@pytest.mark.parametrize("binary", [False, True])
def test_a_gltf_keeps_its_surface_only(tmp_path, binary):
    top = gltf()
    if binary:
        del top["buffers"][0]["uri"]
        text = json.dumps(top).encode()
        (tmp_path / "a.gltf").write_bytes(
            b"glTF"
            + struct.pack("<III4s", 2, 0, len(text), b"JSON")
            + text
            + struct.pack("<I4s", 12, b"BIN\0")
            + b"A" * 12
        )
    else:
        (tmp_path / "mesh.bin").write_bytes(b"A" * 12)
        (tmp_path / "a.gltf").write_text(json.dumps(top))
    (tmp_path / "copy").mkdir()
    copy = json.loads(copy_gltf(tmp_path / "a.gltf", tmp_path / "copy")[0].read_text())
    assert "images" not in copy and copy["materials"] == [{"name": "material 0"}]  # a name, and nothing that it uses
    assert copy["buffers"][0]["uri"] == "buffer0.bin" and (tmp_path / "copy/buffer0.bin").read_bytes() == b"A" * 12


@pytest.mark.parametrize(
    "changes, told",
    [
        ({"buffers": [{"uri": "../mesh.bin", "byteLength": 12}]}, "does not lie beside it"),
        ({"buffers": [{"uri": "%2e%2e/mesh.bin", "byteLength": 12}]}, "does not lie beside it"),
        ({"buffers": [{"uri": "C:\\mesh.bin", "byteLength": 12}]}, "does not lie beside it"),
        ({"buffers": [{"uri": "http://x/mesh.bin", "byteLength": 12}]}, "does not lie beside it"),
        ({"buffers": [{"uri": "no.bin", "byteLength": 12}]}, "is not there"),
        ({"buffers": [{"uri": 300 * "n", "byteLength": 12}]}, "is not there"),
        ({"buffers": [{"uri": "data:;base64,%%%", "byteLength": 12}]}, "damaged buffer"),
        ({"buffers": [{"byteLength": 12}]}, "without content"),
        ({"buffers": [{"uri": "mesh.bin", "byteLength": 13}]}, "cut off"),
        ({"buffers": 7}, "no list of objects"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 1 << 40}]}, "beyond its buffers"),
        ({"bufferViews": [{"buffer": "0", "byteLength": 1}]}, "beyond its buffers"),
        ({"accessors": [{"count": 1 << 40}]}, "more values than it holds"),
        ({"extensionsUsed": "KHR_draco_mesh_compression"}, "'extensionsUsed' that is no list"),
        ({"extensionsRequired": 3}, "'extensionsRequired' that is no list"),
        ({"nodes": [{"mesh": 1}]}, "nodes that contradict"),
        ({"nodes": [{"mesh": True}]}, "nodes that contradict"),
        ({"nodes": [{"children": [1]}, {"children": [0]}]}, "nodes that contradict"),
        ({"nodes": [{"children": [2]}, {"children": [2]}, {}]}, "nodes that contradict"),
        ({"nodes": [{"mesh": 0, "scale": [1, 1]}]}, "not finite numbers"),
        ({"nodes": [{"mesh": 0, "matrix": "x"}]}, "not finite numbers"),
        ({"asset": {"version": "1.0"}}, "no glTF 2.0"),
    ],
)
def test_what_is_wrong_with_a_gltf_is_one_sentence(tmp_path, changes, told):
    (tmp_path / "mesh.bin").write_bytes(b"A" * 12)
    (tmp_path / "a.gltf").write_text(json.dumps(gltf(**changes)))
    (tmp_path / "copy").mkdir()
    with pytest.raises(BadInputError, match=told):
        copy_gltf(tmp_path / "a.gltf", tmp_path / "copy")


@pytest.mark.parametrize("content", [b"", b"glTF", b"glTF" + bytes(30), b"[1]", b"{", b"[" * 100_000])
def test_no_gltf_at_all(tmp_path, content):
    (tmp_path / "a.glb").write_bytes(content)
    with pytest.raises(BadInputError):
        copy_gltf(tmp_path / "a.glb", tmp_path)


def test_where_nodes_place_meshes(tmp_path):
    """A child turned by a quarter in a parent that is moved and stretched, both Y up."""
    half = 0.5**0.5
    nodes = [
        {"children": [1], "translation": [1, 2, 3], "scale": [2, 2, 2], "mesh": 0},
        {"mesh": 0, "name": "child", "rotation": [0, half, 0, half], "translation": [1, 0, 0]},
    ]
    first, second = placed_meshes(nodes, 1, tmp_path)
    assert (first.name, second.name) == ("", "child")
    np.testing.assert_allclose(first.matrix @ [0, 0, 0, 1], [1, -3, 2, 1])
    # z of glTF's becomes x by the turn, and -y here; x becomes -z, and y here.
    np.testing.assert_allclose(second.matrix @ [0, -1, 0, 1], [1 + 2 * (1 + 1), -3, 2, 1], atol=1e-12)
    np.testing.assert_allclose(second.matrix @ [1, 0, 0, 1], [1 + 2, -3 + 2, 2, 1], atol=1e-12)
