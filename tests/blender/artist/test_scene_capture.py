"""The open scene as a capture that the reader takes, seen from the reader's side."""

import json

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.io.read import read_capture
from addon.core.scene.lenses import EnhancedUnified
from addon.core.scene.lenses_colmap import polynomial
from addon.core.scene.model import Camera, Frame

bpy = pytest.importorskip("bpy")

from addon.bridge.data.cameras import make_cameras  # noqa: E402
from addon.bridge.data.unwrap import unwrap  # noqa: E402
from addon.bridge.own_scene.capture import capture_scene, polygons_of, sources  # noqa: E402
from tests.blender.artist.artist_room import add_cameras, build_room, mesh_object, show  # noqa: E402


@pytest.fixture
def room(scene, tmp_path):
    things = build_room()
    add_cameras(tmp_path, 4)
    return things


def captured(folder, things):
    warnings = capture_scene(bpy.context, folder, things)
    return read_capture(folder), warnings


def normals(mesh, chosen):
    a, b, c = (mesh.vertices[mesh.triangles[chosen][:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def test_objects_and_their_places(room, tmp_path):
    capture, warnings = captured(tmp_path / "capture", room.values())
    names = {source.object_id: source for source in sources(tmp_path / "capture")}
    wholes = [names[one.object_id] for one in capture.instances if one.part_of is None]
    assert [source.whole for source in wholes] == sorted([*(set(room) - {"shelf"}), "shelf/board 0", "shelf/board 1"])
    for source in wholes:
        parts = [one.object_id for one in capture.instances if source.object_id in (one.object_id, one.part_of)]
        own = np.isin(capture.mesh.object_id, parts)
        assert len(parts) == (3 if source.thing == "table" else 1)
        thing = bpy.context.scene.objects[source.thing]
        corners = capture.mesh.vertices[np.unique(capture.mesh.triangles[own])]
        if source.own and not thing.modifiers:
            wanted = np.array([thing.matrix_world @ vertex.co for vertex in thing.data.vertices])
            np.testing.assert_allclose(corners, wanted, atol=1e-6)
        area = np.linalg.norm(normals(capture.mesh, own), axis=1).sum() / 2
        if source.own and not thing.modifiers and source.thing != "mirrored":
            assert area == pytest.approx(sum(face.area for face in thing.data.polygons), rel=1e-5), source.name
    assert len(warnings) == 1 and "'round', 'shelf/board 0', 'shelf/board 1'" in warnings[0] and "copy" in warnings[0]
    assert not names[[k for k, s in names.items() if s.name == "round"][0]].own


def test_a_mirrored_box_faces_outwards(room, tmp_path):
    capture, _ = captured(tmp_path / "capture", [room["mirrored"]])
    centre = capture.mesh.vertices.mean(0)
    middle = capture.mesh.vertices[capture.mesh.triangles].mean(1)
    assert ((middle - centre) * normals(capture.mesh, slice(None))).sum(1).min() > 0


def test_objects_of_one_mesh_are_of_one_kind(room, tmp_path):
    capture, _ = captured(tmp_path / "capture", room.values())
    classes = [one.class_name for one in capture.instances]
    assert classes.count("chair") == 2 and len(set(classes)) == len(classes) - 1


def test_frames_are_the_cameras(room, tmp_path, scene):
    capture, _ = captured(tmp_path / "capture", room.values())
    assert [frame.name for frame in capture.frames] == [f"cam_{k}" for k in range(4)]
    for frame, k in zip(capture.frames, range(4)):
        assert (tmp_path / f"photo_{k}.exr").samefile(frame.path)
        thing = scene.objects[f"cam {k}"]
        np.testing.assert_allclose(frame.camera.camera_to_world, np.array(thing.matrix_world), atol=1e-6)
        assert frame.camera.fx == pytest.approx(18 / 36 * 48) and frame.camera.cx == pytest.approx(24 - 0.03 * 48)


@pytest.mark.parametrize(
    "lens", [polynomial("OPENCV", numerator=(-0.1, 0.01), tangential=(1e-3, 2e-3)), EnhancedUnified(0.7, 1.1)]
)
def test_lens_and_exposure_of_imported_cameras(scene, tmp_path, lens):
    pose = np.array([[1, 0, 0, 0.1], [0, 1, 0, 0.2], [0, 0, 1, 3.0], [0, 0, 0, 1]])
    write_exr(tmp_path / "photo.exr", np.ones((36, 48, 3), np.float32))
    wanted = Camera(48, 36, 30.0, 31.0, 23.0, 19.0, pose, lens)
    [camera] = make_cameras([Frame("photo", tmp_path / "photo.exr", wanted, exposure=0.25)], scene.collection)
    show(camera, tmp_path / "photo.exr")
    sheet = mesh_object("sheet", [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)])
    bpy.context.view_layer.update()
    capture, _ = captured(tmp_path / "capture", [sheet])
    [frame] = capture.frames
    assert frame.camera.lens == lens and frame.exposure == 0.25
    np.testing.assert_allclose([frame.camera.fx, frame.camera.cy], [30.0, 19.0], rtol=1e-6)


def test_the_scene_is_left_as_it_was(room, tmp_path, scene):
    scene.frame_set(17)
    before = {thing.name: (thing.select_get(), tuple(thing.keys())) for thing in scene.objects}
    counts = {kind: len(getattr(bpy.data, kind)) for kind in ("meshes", "objects", "images", "materials")}
    captured(tmp_path / "capture", room.values())
    assert before == {thing.name: (thing.select_get(), tuple(thing.keys())) for thing in scene.objects}
    assert counts == {kind: len(getattr(bpy.data, kind)) for kind in counts} and scene.frame_current == 17


def test_once_more_gives_the_same_files(room, tmp_path):
    def content():
        return {
            path.name: path.read_bytes()
            for path in (tmp_path / "capture").iterdir()
            if path.is_file() and path.suffix != ".npz"
        }

    captured(tmp_path / "capture", room.values())
    first = content()
    captured(tmp_path / "capture", room.values())
    assert first == content() and len(first) == 4


def test_triangles_lead_back_to_faces_that_stay_whole(room, tmp_path):
    capture, _ = captured(tmp_path / "capture", room.values())
    polygons = polygons_of(capture.root, capture.mesh)
    np.testing.assert_array_equal(polygons.vertex[polygons.corner], capture.mesh.triangles)
    uv = unwrap(capture.mesh, 512, polygons=polygons)
    corner_uv = np.full((len(polygons.vertex), 2), np.nan, np.float32)
    corner_uv[polygons.corner.ravel()] = uv.reshape(-1, 2)
    np.testing.assert_array_equal(corner_uv[polygons.corner], uv)  # no corner has two coordinates
    assert np.isfinite(corner_uv).all()


def test_units_become_metres(room, tmp_path, scene):
    first, _ = captured(tmp_path / "capture", [room["room"]])
    scene.unit_settings.scale_length = 0.01
    second, _ = captured(tmp_path / "second", [room["room"]])
    np.testing.assert_allclose(second.mesh.vertices, first.mesh.vertices * 0.01)
    np.testing.assert_allclose(second.frames[1].camera.centre, first.frames[1].camera.centre * 0.01)


def test_a_bad_picture_among_good_ones_is_left_out(room, tmp_path):
    (tmp_path / "photo_2.exr").unlink()
    capture, warnings = captured(tmp_path / "capture", [room["room"]])
    assert len(capture.frames) == 3
    assert "1 of 4 pictures are left out" in warnings[0]
    assert "photo_2.exr' behind camera 'cam 2' is missing" in warnings[0]


@pytest.mark.parametrize(
    "spoil, sentence",
    [
        (
            lambda room: [
                thing.data.background_images.clear() for thing in bpy.context.scene.objects if thing.type == "CAMERA"
            ],
            "No camera has a picture behind it",
        ),
        (
            lambda room: [setattr(image, "filepath", "//photo.png") for image in bpy.data.images],
            "None of the pictures can be used: .* no EXR",
        ),
        (lambda room: room["room"].data.clear_geometry(), "No object with faces is selected"),
        (lambda room: room["room"].data.vertices[0].co.__setitem__(0, float("nan")), "'room' has vertices that are"),
    ],
)
def test_what_cant_be_captured_is_told(room, tmp_path, spoil, sentence):
    spoil(room)
    bpy.context.view_layer.update()
    with pytest.raises(BadInputError, match=sentence):
        capture_scene(bpy.context, tmp_path / "capture", [room["room"]])
    assert not (tmp_path / "capture").exists()


def test_a_folder_of_something_else_is_not_replaced(room, tmp_path):
    (tmp_path / "capture").mkdir()
    (tmp_path / "capture" / "mine.txt").write_text("mine")
    with pytest.raises(BadInputError, match="holds something else"):
        capture_scene(bpy.context, tmp_path / "capture", room.values())


def test_a_flat_triangle_does_not_shift_the_others(scene, tmp_path):
    corners = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    thing = mesh_object("sheet", corners, [(0, 1, 2), (0, 2, 3), (0, 3, 4)])
    add_cameras(tmp_path, 2)
    capture, _ = captured(tmp_path / "capture", [thing])
    polygons = polygons_of(capture.root, capture.mesh)
    assert polygons.face.tolist() == [1, 2] and len(capture.mesh.triangles) == 2
    assert json.loads((tmp_path / "capture" / "scene.json").read_text())["objects"][0]["thing"] == "sheet"
