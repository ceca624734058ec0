"""Segments that the user gives: files of ids, painted meshes, materials, shape."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io import segments as module
from addon.core.io.exr import write_exr
from addon.core.io.fingerprint import fingerprint
from addon.core.io.instances import MAX_ID
from addon.core.io.layout import Faces, RawMesh, Reading
from addon.core.io.read import read_capture
from tests.core.io.conftest import CORNERS, HEIGHT, SIDES, WIDTH, ply_text
from tests.core.io.hostile import cases
from tests.core.io.test_objects import boxes
from tests.core.replica_on_disk import ReplicaOnDisk
from tests.core.rooms import lit_box, make_room

IDS = [7, 7, 2, 2, 9, 0]
PALETTE = {7: (255, 0, 0), 2: (0, 128, 255), 9: (0, 0, 0), 0: (255, 255, 255)}


def number(colour):
    return colour[0] + 256 * colour[1] + 65536 * colour[2]


def painted(vertices, faces, of_vertex=(), of_face=(), binary=False):
    """A PLY; `of_vertex` and `of_face` are (kind, names, values), one row for each."""
    body = []
    head = ["ply", f"format {'binary_big_endian' if binary else 'ascii'} 1.0", f"element vertex {len(vertices)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    kinds = {"uchar": ">u1", "ushort": ">u2", "int": ">i4", "float": ">f4"}
    for kind, names, _ in of_vertex:
        head += [f"property {kind} {name}" for name in names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    for kind, names, _ in of_face:
        head += [f"property {kind} {name}" for name in names]
    head.append("end_header")
    rows = [([("float", vertices[i])], of_vertex, i) for i in range(len(vertices))]
    rows += [([("uchar", [len(face)]), ("int", face)], of_face, i) for i, face in enumerate(faces)]
    for own, more, i in rows:
        values = own + [(kind, np.atleast_1d(column[i])) for kind, _, column in more]
        if binary:
            body += [np.array(value).astype(kinds[kind]).tobytes() for kind, value in values]
        else:
            body.append((" ".join(str(x) for _, value in values for x in value) + "\n").encode())
    return "\n".join(head).encode() + b"\n" + b"".join(body)


@pytest.fixture
def given(capture, tmp_path):
    """Reads the capture with a file of segments of that name and content."""
    (capture.root / "info_semantic.json").unlink()

    def read(name, content):
        path = tmp_path / name
        if isinstance(content, np.ndarray):
            np.save(path, content)
        else:
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_capture(capture.root, Reading(segments=path))

    return read


def npy_head(count):
    """A file that claims so many numbers and holds none."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<i8", "fortran_order": False, "shape": (count,)})
    return file.getvalue()


def refused(given, name, content):
    with pytest.raises(BadInputError) as error:
        given(name, content)
    sentence = str(error.value)
    assert f"'{name}'" in sentence or f"/{name}'" in sentence or f"\\{name}'" in sentence
    assert sentence.endswith(".") and "\n" not in sentence and "; " in sentence
    return sentence


@pytest.mark.parametrize(
    "name, content",
    [
        ("ids.txt", "".join(f"{i}\n" for i in IDS)),
        ("ids.csv", "# face by face\n\n7\n 7 # the same\r\n2\n2.0\n9e0\n\n0"),
        ("ids.TXT", "\ufeff" + "\n".join(map(str, IDS))),
        ("ids.npy", np.array(IDS, np.uint8)),
        ("ids.npy", np.array(IDS, ">i8")[:, None]),
        ("ids.npy", np.array(IDS, np.float32)),
    ],
)
def test_a_number_for_each_face_is_for_all_of_its_triangles(given, name, content):
    read = given(name, content)
    assert read.mesh.object_id.tolist() == np.repeat(IDS, 2).tolist()
    assert {one.object_id: one.class_name for one in read.instances} == {i: f"segment_{i}" for i in set(IDS)}
    assert not any(one.guess for one in read.instances) and not read.mesh.whole and read.mesh.closed is None
    assert any("4 segments" in one for one in read.warnings)
    assert not any("object_id" in one or "info_semantic" in one for one in read.warnings)


def test_faces_are_counted_as_in_the_file(capture, given, text_of_ply):
    """A triangle, an edge that is no face, a pentagon, a triangle without area, a quad."""
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0.5, 2, 0), (0, 1, 0), (2, 0, 0)]
    faces = [(0, 1, 2), (0, 1), (0, 1, 2, 3, 4), (0, 1, 5), (0, 1, 2, 4), (3, 4)]
    capture.mesh(text_of_ply(vertices, faces))
    read = given("ids.txt", "10 11 12 13 14 15".replace(" ", "\n"))
    assert read.mesh.object_id.tolist() == [10, 12, 12, 12, 14, 14]
    assert [one.object_id for one in read.instances] == [10, 12, 14]
    assert "has 7 ids, but mesh 'mesh.ply' has 6 faces and 6 vertices" in refused(given, "ids.txt", "1\n" * 7)


def test_a_number_for_each_vertex_is_for_most_of_a_triangle(capture, given, text_of_ply):
    capture.mesh(text_of_ply(CORNERS, [(0, 1, 2), (0, 1, 4), (4, 0, 5), (1, 2, 7)]))
    read = given("ids.txt", "\n".join(map(str, [0, 0, 1, 1, 2, 2, 3, 3])))
    assert read.mesh.object_id.tolist() == [0, 0, 2, 0]


def test_where_both_counts_are_the_same_faces_go_first(capture, given, text_of_ply):
    capture.mesh(text_of_ply(CORNERS[:4], [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)]))
    assert given("ids.txt", "0\n1\n2\n3").mesh.object_id.tolist() == [0, 1, 2, 3]


COLOURS = [PALETTE[i] for i in IDS]
OF_VERTEX = [3, 3, 3, 3, 8, 8, 8, 8]


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize(
    "of_face",
    [
        [("int", ["object_id"], IDS)],
        [("ushort", ["segment"], IDS), ("uchar", ["red", "green", "blue"], [[i, i, i] for i in range(6)])],
        [("uchar", ["label"], IDS)],
        [("uchar", ["red", "green", "blue", "alpha"], [(*one, 255) for one in COLOURS])],
        [("float", ["red", "green", "blue"], np.array(COLOURS) / 255)],
    ],
    ids=["object_id", "segment", "label", "colours", "colours from 0 to 1"],
)
def test_faces_of_a_painted_mesh(given, of_face, binary):
    content = painted(
        CORNERS, SIDES, [("uchar", ["red", "green", "blue"], np.arange(24).reshape(8, 3))], of_face, binary
    )
    numbers = [number(one) for one in COLOURS] if len(of_face[0][1]) > 1 else IDS
    assert given("painted.ply", content).mesh.object_id.tolist() == np.repeat(numbers, 2).tolist()


@pytest.mark.parametrize("faces", [SIDES, []], ids=["mesh", "points"])
@pytest.mark.parametrize("colours", [False, True])
def test_vertices_of_a_painted_mesh(capture, given, text_of_ply, faces, colours):
    quads = [[side[i] for i in corners] for side in SIDES for corners in ((0, 1, 2), (0, 2, 3))]
    capture.mesh(text_of_ply(CORNERS, quads))
    values = [PALETTE[2] if one == 3 else PALETTE[7] for one in OF_VERTEX] if colours else OF_VERTEX
    column = ("uchar", ["red", "green", "blue"], values) if colours else ("ushort", ["label"], values)
    found = given("painted.ply", painted(CORNERS, faces, [column])).mesh.object_id
    wanted = np.array(OF_VERTEX)[np.array(quads)]
    wanted = np.where(wanted[:, 1] == wanted[:, 2], wanted[:, 1], wanted[:, 0])
    names = {3: number(PALETTE[2]), 8: number(PALETTE[7])} if colours else {3: 3, 8: 8}
    assert found.tolist() == [names[int(one)] for one in wanted]


def test_a_painted_mesh_may_list_its_vertices_otherwise(given):
    """As programs write one whose vertices were split at seams: its faces are the same, in the same order."""
    corners = [CORNERS[v] for side in SIDES for v in side]
    faces = np.arange(24).reshape(6, 4).tolist()
    content = painted(corners, faces, [("uchar", ["red", "green", "blue"], np.repeat(COLOURS, 4, axis=0))])
    wanted = np.repeat([number(one) for one in COLOURS], 2)
    assert given("painted.ply", content).mesh.object_id.tolist() == wanted.tolist()


def test_the_list_of_names_names_segments(capture, given):
    capture.objects({"objects": [{"id": 7, "class_name": "wall"}, {"id": 9, "class_name": "sofa"}]})
    names = {one.object_id: one.class_name for one in given("ids.txt", "\n".join(map(str, IDS))).instances}
    assert names == {0: "segment_0", 2: "segment_2", 7: "wall", 9: "sofa"}


def test_segments_go_before_pictures_of_ids(tmp_path):
    root = tmp_path / "capture"
    cases.fipt_real(root)
    (root / "segmentation").mkdir()
    for i in range(cases.COUNT):
        write_exr(root / f"segmentation/{i:03d}.exr", np.full((HEIGHT, WIDTH), 3.0))
    vertices, triangles = boxes((0, 0, 0), (9, 0, 0), size=5)
    (root / "mesh.ply").write_text(ply_text(vertices.tolist(), triangles.tolist()))
    (tmp_path / "ids.txt").write_text("7\n" * 20 + "2\n" * 4)
    reading = Reading(mesh=root / "mesh.ply")
    assert set(read_capture(root, reading).mesh.object_id.tolist()) == {3}
    read = read_capture(root, replace(reading, segments=tmp_path / "ids.txt"))
    assert read.mesh.object_id.tolist() == [7] * 20 + [2] * 4
    assert names_of(read_capture(root, replace(reading, segments="shape"))) == ["part_0"] * 12 + ["part_1"] * 12


def test_shape_passes_over_what_the_file_tells(capture):
    vertices, triangles = boxes((0, 0, 0), (3, 0, 0))
    capture.mesh(ply_text(vertices.tolist(), triangles.tolist(), [0, 1, 2] * 8))
    assert len(read_capture(capture.root).instances) == 3
    read = read_capture(capture.root, Reading(segments="shape"))
    assert names_of(read) == ["part_0"] * 12 + ["part_1"] * 12
    assert read.mesh.whole and all(one.guess for one in read.instances)
    assert any(one.startswith("By its shape the mesh has 2 objects") for one in read.warnings)


def test_a_run_is_known_by_the_segments(capture, given):
    keys = [fingerprint(given("ids.txt", "\n".join(map(str, ids)))) for ids in (IDS, IDS, IDS[::-1])]
    keys.append(fingerprint(read_capture(capture.root)))
    assert keys[0] == keys[1] and len(set(keys)) == 3


@pytest.mark.parametrize(
    "name, content, told",
    [
        ("few.txt", "1\n2\n", "2 ids, but mesh 'mesh.ply' has 6 faces and 8 vertices"),
        ("triangles.txt", "1\n" * 12, "12 ids, but mesh 'mesh.ply' has 6 faces"),
        ("empty.txt", "", "0 ids"),
        ("minus.txt", "1\n1\n-1\n1\n1\n1\n", "'-1' as number 3"),
        ("half.txt", "1\n1\n0.5\n1\n1\n1\n", "'0.5' as number 3"),
        ("nan.txt", "nan\n" * 6, "'nan' as number 1"),
        ("huge.txt", f"{MAX_ID + 1}\n" * 6, f"'{MAX_ID + 1}' as number 1"),
        ("word.csv", "face,id\n" + "1\n" * 6, "'face,id' as number 1"),
        ("long.txt", "x" * 5000, "'xxx"),
        ("row.csv", "1,1,2,2,3,3\n", "one a line"),
        ("binary.txt", b"\xff\xfe\x00\x80", "is no text"),
        ("few.npy", np.arange(5), "5 ids"),
        ("minus.npy", np.arange(6) - 1, "'-1' as number 1"),
        ("half.npy", np.arange(6) / 2, "'0.5' as number 2"),
        ("large.npy", np.full(6, 2**63, np.uint64), "as number 1"),
        ("table.npy", np.zeros((6, 2), int), "no row of integers"),
        ("scalar.npy", np.array(3), "no row of integers"),
        ("words.npy", np.array(list("abcdef")), "no row of integers"),
        ("text.npy", "1\n" * 6, "no row of integers"),
        ("cut.npy", npy_head(9), "damaged or cut"),
        ("vast.npy", npy_head(10**11), "damaged or cut"),
        ("plain.ply", painted(CORNERS, SIDES), "neither object_id"),
        ("other.ply", painted(CORNERS[:3], [(0, 1, 2)], [], [("int", ["label"], [0])]), "1 ids of faces"),
        ("few.ply", painted(CORNERS[:3], [(0, 1, 2)], [("int", ["label"], [0, 0, 0])]), "3 ids of vertices"),
        ("minus.ply", painted(CORNERS, SIDES, [], [("int", ["label"], [-1] * 6)]), "'-1"),
        ("deep.ply", painted(CORNERS, SIDES, [], [("ushort", ["red", "green", "blue"], [(999, 0, 0)] * 6)]), "8 bits"),
        ("nan.ply", painted(CORNERS, SIDES, [], [("float", ["red", "green", "blue"], [(np.nan,) * 3] * 6)]), "8 bits"),
        ("cut.ply", painted(CORNERS, SIDES, [], [("int", ["label"], IDS)], True)[:-3], "ends within"),
        ("none.ply", b"", "is empty"),
        ("picture.png", b"\x89PNG", "no kind that is known"),
    ],
)  # fmt: skip
def test_what_is_no_file_of_segments(given, name, content, told):
    assert told in refused(given, name, content)


def test_a_pickled_array_is_not_unpickled(given, tmp_path):
    class Evil:
        def __reduce__(self):
            return Path.touch, (tmp_path / "done",)

    np.save(tmp_path / "evil.npy", np.array([Evil()] * 6, object), allow_pickle=True)
    refused(given, "evil.npy", (tmp_path / "evil.npy").read_bytes())
    assert not (tmp_path / "done").exists()


def test_a_photographed_mesh_is_no_painted_one(capture, given, text_of_ply):
    count = module.MAX_COLOURS + 1
    vertices = [(x, y, 0.0) for x in range(count) for y in (0, 1)]
    triangles = [(2 * i, 2 * i + 1, 2 * i + 2) for i in range(count - 1)]
    capture.mesh(text_of_ply(vertices, triangles))
    colours = [(i % 256, i // 256, 0) for i in range(count) for _ in range(2)]
    told = refused(given, "scan.ply", painted(vertices, triangles, [("uchar", ["red", "green", "blue"], colours)]))
    assert f"{count} different colours" in told


@pytest.mark.parametrize("segments", ["nowhere.txt", Path("material"), "."])
def test_what_is_not_there(capture, segments):
    with pytest.raises(
        BadInputError, match="'.*' (does not exist|is not a file); give --segments .*materials or shape"
    ):
        read_capture(capture.root, Reading(segments=segments))


def test_a_missing_file_is_told_before_the_capture_is_read(capture):
    (capture.root / "transforms.json").write_text("{")
    with pytest.raises(BadInputError, match="nowhere.txt"):
        read_capture(capture.root, Reading(segments="nowhere.txt"))


def test_mirrors_that_are_a_segment_of_their_own_stay_mirrors(tmp_path):
    replica = ReplicaOnDisk(
        tmp_path / "replica", room := make_room(lit_box(), 0.3), np.ones((len(room.atlas.object_id), 3))
    )
    pane = {"plane_w": [0, 0, 1, 0], "boundary_w": [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], "reflectivity": 0.9}
    (replica.root / "glass.sur").write_text(json.dumps([pane]))
    found = read_capture(replica.root)
    [mirror] = found.mirrors
    own = np.array([quad.object_id for quad in replica.quads])
    for ids, mirrors in ((10 + own, [10 + mirror.object_id]), (0 * own, [])):
        (tmp_path / "ids.txt").write_text("\n".join(map(str, ids)))
        read = read_capture(replica.root, Reading(segments=tmp_path / "ids.txt"))
        assert [one.object_id for one in read.mirrors] == mirrors
        assert not any("belong to no object" in one for one in read.warnings)
    assert not read_capture(replica.root, Reading(segments="shape")).mirrors


def imported(**changes):
    """What an importer gives for a box of two objects and two materials, its triangles in another order."""
    triangles = np.array([(q[0], q[i], q[i + 1]) for q in SIDES for i in (1, 2)], np.int32)
    mesh = RawMesh(
        np.array(CORNERS, float), triangles, np.repeat([0, 1], [8, 4]), names={0: "chair", 1: "table"}, name="room.obj",
        material=np.array([0, 0, 1, 1, -1, -1, 0, 0, 0, 0, 1, 1], np.int32), material_names=("wood", "steel"),
        faces=Faces(6, np.repeat([5, 4, 3, 2, 1, 0], 2), own_vertices=False),
    )  # fmt: skip
    return replace(mesh, **changes)


def read_imported(capture, mesh, segments):
    path = capture.root / "room.obj"
    path.write_text("")
    (capture.root / "info_semantic.json").unlink(missing_ok=True)
    return read_capture(capture.root, Reading(mesh=path, segments=segments, import_mesh=lambda path: mesh))


def names_of(read):
    names = {one.object_id: one.class_name for one in read.instances}
    return [names[i] for i in read.mesh.object_id.tolist()]


def test_materials_part_objects(capture):
    read = read_imported(capture, imported(), "materials")
    chair = ["chair: wood"] * 2 + ["chair: steel"] * 2 + ["chair: no material"] * 2 + ["chair: wood"] * 2
    assert names_of(read) == [*chair, "table: wood", "table: wood", "table: steel", "table: steel"]
    assert not any(one.guess for one in read.instances) and not read.mesh.whole
    assert set(names_of(read_imported(capture, imported(), ""))) == {"chair", "table"}


def test_of_one_object_materials_alone_are_named(capture):
    read = read_imported(capture, imported(object_id=None, names=None, material_names=("wood", "")), "materials")
    assert set(names_of(read)) == {"wood", "material_1", "no material"}


def test_of_an_imported_mesh_the_order_in_its_file_counts(capture, tmp_path):
    path = tmp_path / "ids.txt"
    path.write_text("\n".join(map(str, range(6))))
    read = read_imported(capture, imported(), path)
    assert read.mesh.object_id.tolist() == np.repeat([5, 4, 3, 2, 1, 0], 2).tolist()
    path.write_text("1\n" * 8)  # vertices are listed anew
    with pytest.raises(BadInputError, match=r"8 ids, but mesh 'room.obj' has 6 faces; give one for each face"):
        read_imported(capture, imported(), path)
    unordered = imported(faces=imported().faces._replace(total=-1))
    with pytest.raises(BadInputError, match="order of the faces of 'room.obj' can't be told"):
        read_imported(capture, unordered, path)
    assert len(read_imported(capture, unordered, "materials").instances) == 5


@pytest.mark.parametrize("material", [None, np.full(12, -1, np.int32)])
def test_materials_of_a_mesh_without(capture, material):
    with pytest.raises(BadInputError, match="Mesh 'room.obj' has no materials"):
        read_imported(capture, imported(material=material), "materials")
