"""Where no face carries an object: pictures of ids, connected parts, one object."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace

import numpy as np
import OpenEXR
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.io.id_pictures import read_ids
from addon.core.io.png import write_png
from addon.core.io.read import read_capture
from addon.core.scene.closed_mesh import without_closing
from addon.core.scene.connected_parts import connected_parts
from addon.core.scene.model import Frame
from addon.core.scene.rays import RayScene
from addon.core.scene.vote import vote
from addon.core.significance import LEVELS
from tests.core.rooms import all_round, lit_box, make_room
from tests.core.scene.test_closing import CEILING
from tests.core.scene.test_closing import room as torn


def boxes(*places, size=1.0):
    """Cubes of 12 triangles each whose vertices are listed anew for every triangle, as an STL has them."""
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float) * size
    quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    soup = np.concatenate([corners[faces].reshape(-1, 3) + place for place in places])
    return soup, np.arange(len(soup)).reshape(-1, 3)


def test_parts_are_welded_by_place():
    vertices, triangles = boxes((0, 0, 0), (3, 0, 0), (0, 5, 0))
    part = connected_parts(vertices, triangles).reshape(3, 12)
    assert (part == part[:, :1]).all() and sorted(part[:, 0].tolist()) == [0, 1, 2]


def test_the_greatest_part_comes_first_and_crumbs_join_the_nearest():
    small, a = boxes((0, 0, 0))
    large, b = boxes((3, 0, 0), size=4)
    crumb, c = boxes((-0.1, 0, 0), size=0.01)
    vertices = np.concatenate([small, large, crumb])
    part = connected_parts(vertices, np.concatenate([a, b + len(small), c + len(small) + len(large)]))
    assert part.tolist() == [1] * 12 + [0] * 12 + [1] * 12


def test_the_number_of_parts_is_bounded():
    part = connected_parts(*boxes(*((3.0 * i, 0, 0) for i in range(LEVELS.most + 9))))
    assert np.unique(part).tolist() == list(range(LEVELS.most))


def test_a_capture_of_loose_parts_gets_an_object_for_each(capture, text_of_ply):
    vertices, triangles = boxes((0, 0, 0), (3, 0, 0))
    capture.mesh(text_of_ply(vertices.tolist(), triangles.tolist()))
    (capture.root / "info_semantic.json").unlink()
    read = read_capture(capture.root)
    assert [one.class_name for one in read.instances] == ["part_0", "part_1"]
    assert all(one.guess for one in read.instances)
    assert any("By its shape the mesh has 2" in warning for warning in read.warnings)


@pytest.fixture(scope="module")
def room():
    return make_room(lit_box(lamps=(((0.3, 0.7), (0.3, 0.7)),)), 0.1)


def seen_ids(room, camera):
    """What a renderer would write: the object behind each pixel."""
    directions = camera.directions(camera.pixel_centres())
    origins = np.broadcast_to(camera.centre.astype(np.float32), directions.shape)
    triangle = RayScene(room.mesh.vertices, room.mesh.triangles).intersect(origins, directions).triangle
    return room.mesh.object_id[triangle].reshape(camera.height, camera.width).astype(np.int64)


def frames_of(room, tmp_path, change=lambda ids: ids, ending="exr"):
    frames = []
    for i, camera in enumerate(all_round((1.7, 1.3, 1.1), 40)):
        path = tmp_path / f"{i}.{ending}"
        ids = change(seen_ids(room, camera))
        if ending == "exr":
            write_exr(path, np.repeat(ids[..., None], 3, -1).astype(np.float32))
        else:
            write_png(path, np.stack([ids % 256, ids // 256 % 256, ids // 65536], -1).astype(np.uint8))
        frames.append(Frame(f"{i}", path, camera, id_path=path))
    return frames


@pytest.mark.parametrize("ending, shift", [("exr", 0), ("exr", 70_001), ("png", 0), ("png", 70_001)])
def test_the_vote_finds_the_objects(room, tmp_path, ending, shift):
    frames = frames_of(room, tmp_path, lambda ids: ids + shift, ending)
    found, notes = vote(room.mesh.vertices, room.mesh.triangles, frames, read_ids)
    assert (found == room.mesh.object_id + shift).mean() > 0.99
    assert "voted" in notes[0]


def test_the_vote_outlives_wrong_pixels_and_a_damaged_picture(room, tmp_path):
    rng = np.random.default_rng(0)
    frames = frames_of(room, tmp_path, lambda ids: np.where(rng.random(ids.shape) < 0.02, 99, ids))
    (tmp_path / "cut.exr").write_bytes(b"v/1\x01")
    frames.append(replace(frames[0], id_path=tmp_path / "cut.exr"))
    found, notes = vote(room.mesh.vertices, room.mesh.triangles, frames, read_ids)
    assert (found == room.mesh.object_id).mean() > 0.99
    assert "1 pictures of ids can't be used" in notes[1]


def test_what_no_pixel_sees_takes_its_neighbours_ids(room, tmp_path):
    frames = frames_of(room, tmp_path)
    hidden, extra = boxes((50, 50, 50))
    vertices = np.concatenate([room.mesh.vertices, hidden])
    triangles = np.concatenate([room.mesh.triangles, extra + len(room.mesh.vertices)])
    found, _ = vote(vertices, triangles, frames[:1], read_ids)
    assert set(found.tolist()) <= set(room.mesh.object_id.tolist())
    assert len(set(found[-12:].tolist())) == 1


def test_pictures_that_are_no_ids_are_told(room, tmp_path):
    [frame, *_] = frames_of(room, tmp_path)
    for values, told in ((0.5, "between whole numbers"), (np.nan, "not finite"), (3e7, "floats can't hold")):
        write_exr(frame.id_path, np.full((frame.camera.height, frame.camera.width, 3), values, np.float32))
        with pytest.raises(BadInputError, match=told):
            vote(room.mesh.vertices, room.mesh.triangles, [frame], read_ids)
    write_exr(frame.id_path, np.zeros((3, 4, 3), np.float32))
    with pytest.raises(BadInputError, match="4 x 3 pixels"):
        vote(room.mesh.vertices, room.mesh.triangles, [frame], read_ids)
    away = replace(frame, camera=replace(frame.camera, camera_to_world=np.eye(4) + 1e3 * np.eye(4, k=3)))
    write_exr(frame.id_path, np.zeros((frame.camera.height, frame.camera.width, 3), np.float32))
    with pytest.raises(BadInputError, match="shows any of the mesh"):
        vote(room.mesh.vertices, room.mesh.triangles, [away], read_ids)


@pytest.mark.parametrize("dtype, value", [(np.uint32, 4_000_000_001), (np.float32, 16_777_215), (np.float16, 2047)])
@pytest.mark.parametrize("names", ["Z", ("R", "G", "B"), ("object.id",)])
def test_large_ids_are_exact(room, tmp_path, dtype, value, names):
    plane = np.full((3, 4), value, dtype)
    plane[0, 0] = value - 1
    header = {"type": OpenEXR.scanlineimage, "chromaticities": (0.7, 0.3, 0.2, 0.7, 0.1, 0.1, 0.3, 0.3)}
    with OpenEXR.File(header, {name: plane for name in names}) as file:
        file.write(str(tmp_path / "ids.exr"))
    frame = Frame("a", tmp_path / "ids.exr", all_round((1, 1, 1))[0], id_path=tmp_path / "ids.exr")
    np.testing.assert_array_equal(read_ids(frame), plane.astype(np.int64))


def test_ids_of_16_bits(tmp_path):
    plane = np.array([[0, 300], [65535, 7]], ">u2")
    rows = b"".join(b"\0" + row.tobytes() for row in plane)
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", 2, 2, 16, 0, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    path = tmp_path / "ids.png"
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
            for kind, data in chunks
        )
    )
    assert read_ids(Frame("a", path, all_round((1, 1, 1))[0], id_path=path)).tolist() == plane.tolist()


def test_a_picture_that_loses_is_refused(tmp_path):
    path = tmp_path / "ids.jpg"
    path.write_bytes(b"\xff\xd8\xff\xe0" + bytes(40))
    with pytest.raises(BadInputError, match="loses nothing"):
        read_ids(Frame("a", path, all_round((1, 1, 1))[0], id_path=path))


def test_holes_of_a_room_in_one_piece_are_closed_unless_objects_are_told(capture, text_of_ply):
    """The faces come last, and belong to the part that they continue."""
    vertices, triangles = torn(lambda centre, side: (side == CEILING) & (centre[:, 1] > 1.9) & (centre[:, 0] > 1.2))
    capture.mesh(text_of_ply(vertices.tolist(), triangles.tolist(), [0] * len(triangles)))
    assert read_capture(capture.root).mesh.closed is None
    capture.mesh(text_of_ply(vertices.tolist(), triangles.tolist()))
    (capture.root / "info_semantic.json").unlink()
    read = read_capture(capture.root)
    assert read.mesh.closed.tolist() == list(range(len(triangles), len(read.mesh.triangles)))
    assert np.array_equal(without_closing(read).mesh.triangles, triangles)
    names = {one.object_id: one.class_name for one in read.instances}
    assert "ceiling" in {names[int(one)] for one in read.mesh.object_id[read.mesh.closed]}
