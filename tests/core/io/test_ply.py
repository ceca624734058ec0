"""PLY: every kind of mesh that a capture may bring, and one sentence for what is none."""

from __future__ import annotations

import struct
import time
import tracemalloc

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.ply import ply_bytes, read_ply

VERTICES = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0)]
FACES = [(0, 1, 2), (0, 1, 2, 3), (0, 1, 2, 4, 3), (2, 4, 3)]
IDS = [7, 8, 9, 7]


def binary(faces, ids, order="<", vertices=VERTICES, count=("uchar", "B"), index=("int", "i")) -> bytes:
    """Doubles, colour in between, object_id in front of the list, an unknown list behind it."""
    name = {"<": "little", ">": "big"}[order]
    header = ["ply", f"format binary_{name}_endian 1.0", "comment made by a test", f"element vertex {len(vertices)}",
              "property double y", "property uchar red", "property double x", "property double z",
              f"element face {len(faces)}", "property int object_id",
              f"property list {count[0]} {index[0]} vertex_index", "property list uchar float texcoord",
              "property short flags", "end_header"]  # fmt: skip
    body = b"".join(struct.pack(order + "dBdd", y, 9, x, z) for x, y, z in vertices)
    for face, number in zip(faces, ids):
        body += struct.pack(f"{order}i{count[1]}{len(face)}{index[1]}", number, len(face), *face)
        body += struct.pack(f"{order}B{len(face)}fh", len(face), *([0.5] * len(face)), 3)
    return "\n".join(header).encode() + b"\n" + body


def write(tmp_path, content):
    path = tmp_path / "mesh.ply"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("count", [("uchar", "B"), ("int", "i"), ("ushort", "H")])
@pytest.mark.parametrize("index", [("int", "i"), ("uint", "I"), ("ushort", "H")])
def test_polygons_of_mixed_length(tmp_path, order, count, index):
    mesh = read_ply(write(tmp_path, binary(FACES, IDS, order, count=count, index=index)))
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    np.testing.assert_array_equal(
        mesh.triangles, [(0, 1, 2), (0, 1, 2), (0, 2, 3), (0, 1, 2), (0, 2, 4), (0, 4, 3), (2, 4, 3)]
    )
    np.testing.assert_array_equal(mesh.object_id, [7, 8, 8, 9, 9, 9, 7])
    assert mesh.vertices.dtype == np.float64 and mesh.triangles.dtype == np.int32 and mesh.uv is None


def test_text_and_binary_agree(tmp_path, text_of_ply):
    text = read_ply(write(tmp_path, text_of_ply(VERTICES, FACES, IDS, uv=[(v[0], v[1]) for v in VERTICES])))
    other = read_ply(write(tmp_path, binary(FACES, IDS)))
    for name in ("vertices", "triangles", "object_id"):
        np.testing.assert_array_equal(getattr(text, name), getattr(other, name))
    np.testing.assert_array_equal(text.uv, np.array(VERTICES, np.float32)[text.triangles][..., :2])


def test_windows_line_ends(tmp_path, text_of_ply):
    mesh = read_ply(write(tmp_path, text_of_ply(VERTICES, FACES, IDS).replace("\n", "\r\n")))
    assert len(mesh.triangles) == 7


def test_quads_split_along_the_shorter_diagonal(tmp_path, text_of_ply):
    kite = [(0, 0, 0), (3, -1, 0), (6, 0, 0), (3, 1, 0)]
    mesh = read_ply(write(tmp_path, text_of_ply(kite, [(0, 1, 2, 3), (1, 2, 3, 0)])))
    shared = [set(a) & set(b) for a, b in zip(mesh.triangles[::2].tolist(), mesh.triangles[1::2].tolist())]
    assert shared == [{1, 3}, {1, 3}]
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()  # the winding stays


@pytest.mark.parametrize("pair", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_names_of_texture_coordinates(tmp_path, text_of_ply, pair):
    text = text_of_ply(VERTICES, FACES, IDS, uv=[(i, -i) for i in range(5)])
    text = text.replace("float s\n", f"float {pair[0]}\n").replace("float t\n", f"float {pair[1]}\n")
    assert read_ply(write(tmp_path, text)).uv[-1].tolist() == [[2, -2], [4, -4], [3, -3]]


def test_points_alone_have_no_triangles(tmp_path, text_of_ply):
    text = text_of_ply(VERTICES, [])
    assert read_ply(write(tmp_path, text)).triangles.shape == (0, 3)
    assert read_ply(write(tmp_path, text.split("element face")[0] + "end_header\n" + "0 0 0\n" * 5)).object_id is None


HEADER = "ply\nformat {0} 1.0\nelement vertex {1}\nproperty float x\nproperty float y\nproperty float z\n" \
         "element face {2}\nproperty list {3} int vertex_indices\nend_header\n"  # fmt: skip


@pytest.mark.parametrize("content, words", [
    (b"", "is empty"),
    (b"solid stl", "not a PLY"),
    (b"ply\nformat ascii 1.0\n", "within its header"),
    (b"ply\nelement vertex 0\nend_header\n", "text or binary"),
    (HEADER.format("ascii", -3, 1, "uchar"), "element vertex -3"),
    (HEADER.format("ascii", "many", 1, "uchar"), "element vertex many"),
    (HEADER.format("ascii", 3, 1, "float"), "list float"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 0 1 1 0 3 0 1 5", "vertex 5.* of 3"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 0 1 1 0 3 0 1 -1", "vertex -1"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 0 1 1 0 3 0 1 nan", "vertex nan"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 0 1 1 0 3 0 1 1.5", "vertex 1.5"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 zero 1 1 0 3 0 1 2", "claims 3|no number"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 0 1 1 0 3 0 1", "cut off|damaged"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 0 1 1 0 -3 0 1 2", "list of -3"),
    (HEADER.format("ascii", 3, 2, "uchar") + "0 0 0 1 0 0 1 1 0 3 0 1 2 -3 0 1 2", "damaged"),
    (HEADER.format("ascii", 3, 1, "uchar") + "0 0 0 1 0 0 1 1 0 1e18 0 1 2", "list of"),
    (HEADER.format("binary_little_endian", 10**12, 1, "uchar"), "claims 1000000000000"),
    (HEADER.format("binary_little_endian", 0, 10**18, "uchar") + "xxxx", "claims 1000000000000000000"),
    (HEADER.format("binary_little_endian", 0, 1, "uint") + "\x7f\x7f\x7f\x7f", "list of"),
    (HEADER.format("ascii", 3, 1, "uchar").replace("x\n", "a\n"), "claims|without x"),
    (HEADER.format("ascii", 1, 0, "uchar").replace("float x\n", "float a\n") + "0 0 0", "without x"),
    (HEADER.format("ascii", 1, 0, "uchar").replace("vertex_indices", "other") + "0 0 0", "without vertex_indices"),
    (HEADER.format("ascii", 3, 1, "uchar").replace("end_", "property list uchar int vertex_indices\nend_")
     + "0 0 0 1 0 0 1 1 0 3 0 1 2 3 0 1 2", "a name that it gives twice"),
])  # fmt: skip
def test_what_is_wrong_is_one_sentence(tmp_path, content, words):
    path = write(tmp_path, content)
    with pytest.raises(BadInputError, match=words) as caught:
        read_ply(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.9, 0.999])
@pytest.mark.parametrize("faces, ids", [(FACES, IDS), ([(0, 1, 2)] * 9, [1] * 9)])
def test_cut_off(tmp_path, share, faces, ids):
    content = binary(faces, ids)
    with pytest.raises(BadInputError, match="mesh.ply"):
        read_ply(write(tmp_path, content[: int(len(content) * share)]))


def test_absent_and_folder(tmp_path):
    for path in (tmp_path / "absent.ply", tmp_path):
        with pytest.raises(BadInputError, match="does not exist|not a file"):
            read_ply(path)


def test_a_hostile_count_takes_no_memory(tmp_path):
    path = write(tmp_path, HEADER.format("binary_little_endian", 10**9, 10**9, "uchar") + "x" * 1000)
    tracemalloc.start()
    with pytest.raises(BadInputError):
        read_ply(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


@pytest.mark.parametrize("mixed", [False, True])
def test_large_meshes_are_read_at_once(tmp_path, mixed):
    n = 100_000
    vertices = np.random.default_rng(0).random((1000, 3)).astype("<f4")
    corners = np.random.default_rng(1).integers(0, 1000, (n, 4))
    quad = np.random.default_rng(2).random(n) < (0.5 if mixed else 0)
    rows = np.zeros((n, 17), np.uint8)
    rows[:, 0] = 3 + quad
    rows[:, 1:] = corners.astype("<i4").view(np.uint8)
    keep = np.ones(rows.shape, bool)
    keep[~quad, 13:] = False
    path = write(
        tmp_path,
        HEADER.format("binary_little_endian", 1000, n, "uchar").encode() + vertices.tobytes() + rows[keep].tobytes(),
    )
    started = time.process_time()
    mesh = read_ply(path)
    assert time.process_time() - started < 3  # some 0.3 s; a loop over faces would take far longer than this
    assert len(mesh.triangles) == n + quad.sum()
    first = np.flatnonzero(~quad)[-1]
    assert mesh.triangles[first + quad[:first].sum()].tolist() == corners[first, :3].tolist()


def test_a_large_mesh_takes_little_memory(tmp_path):
    """Where all faces have as many corners, no positions of values: once eight bytes for each of the file."""
    content = ply_bytes(np.eye(3, dtype=np.float32), [(np.tile([0, 1, 2], (100_000, 1)), 7)])
    path = write(tmp_path, content)
    tracemalloc.start()
    mesh = read_ply(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (mesh.triangles == [0, 1, 2]).all() and (mesh.object_id == 7).all() and len(mesh.triangles) == 100_000
    assert peak < 8 * len(content)


def test_the_living_room(shared):
    mesh = read_ply(shared / "captures/living-room/mesh.ply")
    assert mesh.triangles.shape == (132001, 3) and mesh.uv.shape == (132001, 3, 2)
    assert len(np.unique(mesh.object_id)) == 64


@pytest.mark.parametrize("sizes", [[3, 2_000_000, 4], list(range(3, 2000))], ids=["one long list", "all sizes"])
def test_lists_of_any_length_take_time_by_their_entries(tmp_path, sizes):
    """Once quadratic: minutes for either."""
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 8\n" + "".join(f"property float {a}\n" for a in "xyz")
    head += f"element face {len(sizes)}\nproperty list int int vertex_indices\nend_header\n"
    faces = b"".join(np.append(n, np.arange(n) % 8).astype("<i4").tobytes() for n in sizes)
    started = time.process_time()
    mesh = read_ply(write(tmp_path, head.encode() + np.eye(8, 3, dtype="<f4").tobytes() + faces))
    assert time.process_time() - started < 20
    assert np.array_equal(np.bincount(mesh.faces.of_triangle), np.array(sizes) - 2)
    assert (mesh.faces.corner[mesh.faces.of_triangle == 0] == [0, 1, 2]).all()
