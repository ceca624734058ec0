"""Bad captures: each spoiled in one way, each answered by one sentence or one warning."""

from __future__ import annotations

import os

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.io.fingerprint import fingerprint
from addon.core.io.pixels import read_pixels
from addon.core.io.png import write_png
from addon.core.io.read import describe, read_capture
from tests.core.io.conftest import CORNERS, HEIGHT, SIDES, WIDTH, ply_text


def refused(capture, words: str) -> str:
    with pytest.raises(BadInputError, match=words) as caught:
        read_capture(capture.root)
    assert "\n" not in str(caught.value) and str(caught.value).endswith(".")
    return str(caught.value)


def warned(capture, words: str):
    result = read_capture(capture.root)
    assert any(words in warning for warning in result.warnings), result.warnings
    return result


def test_a_good_capture_has_no_warnings(capture):
    result = read_capture(capture.root)
    assert (len(result.mesh.triangles), len(result.instances), len(result.frames)) == (12, 6, 10)
    assert result.warnings == ()
    assert [frame.name for frame in result.frames] == [f"{i:03d}" for i in range(10)]
    camera = result.frames[3].camera
    assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (8, 6, 6.0, 6.5, 4.0, 3.0)
    np.testing.assert_allclose(camera.camera_to_world, capture.pose(3), atol=1e-12)


def test_the_living_room(shared):
    result = read_capture(shared / "captures/living-room")
    # The file holds 132,001, of which 190 have no area.
    assert (len(result.mesh.triangles), len(result.instances), len(result.frames)) == (131811, 64, 96)
    assert len(result.warnings) == 1 and "190 triangles" in result.warnings[0]
    assert {(frame.camera.width, frame.camera.height) for frame in result.frames} == {(320, 240)}
    pixels = read_pixels(result.frames[0])
    assert pixels.valid.mean() > 0.99 and pixels.radiance.dtype == np.float32


# --- the folder


def test_no_folder_a_file_and_an_empty_folder(tmp_path):
    (tmp_path / "file").touch()
    for name, words in (("absent", "does not exist"), ("file", "not a folder"), (".", "transforms.json")):
        with pytest.raises(BadInputError, match=words):
            read_capture(tmp_path / name)


@pytest.mark.parametrize("text, words", [
    ("", "not valid JSON"), ("[1]", "no JSON object"), ("{}", "no frames"), ('{"frames": []}', "no frames"),
    ('{"frames": {}}', "no frames"), ("[" * 100_000, "not valid JSON"), ("\xff", "JSON"),
])  # fmt: skip
def test_poses_that_are_none(capture, text, words):
    (capture.root / "transforms.json").write_text(text, encoding="latin-1")
    refused(capture, words)


# --- the mesh


def test_no_mesh(capture):
    (capture.root / "mesh.ply").unlink()
    refused(capture, "mesh.ply' does not exist")


@pytest.mark.parametrize("faces", [[], [(0, 1)], [(0, 0, 1), (2, 2, 2)]])
def test_a_mesh_without_triangles(capture, text_of_ply, faces):
    capture.mesh(text_of_ply([(0, 0, 0), (1, 0, 0), (0, 1, 0)], faces, [0] * len(faces)))
    refused(capture, "no triangle")


def test_degenerate_triangles_are_counted_and_left_out(capture, text_of_ply):
    nan, inf = float("nan"), float("inf")
    vertices = [(0, 0, 0), (nan, 0, 0), (4, 0, 0), (0, 4, 0), (8, 0, 0), (inf, 1, 1), (1e30, 0, 0)]
    faces = [(0, 2, 3), (0, 2, 2), (0, 2, 4), (0, 1, 2), (2, 4, 3), (0, 2, 5), (0, 3, 6)]
    capture.mesh(text_of_ply(vertices, faces, [0, 0, 0, 0, 1, 0, 0], uv=[(i, nan) for i in range(7)]))
    result = warned(capture, "2 triangles of 'mesh.ply' have no area")
    assert any("3 triangles of 'mesh.ply' have vertices that are not finite" in w for w in result.warnings)
    assert np.isfinite(result.mesh.vertices).all() and np.isfinite(result.mesh.uv).all()
    np.testing.assert_array_equal(
        result.mesh.vertices[result.mesh.triangles],
        [[(0, 0, 0), (4, 0, 0), (0, 4, 0)], [(4, 0, 0), (8, 0, 0), (0, 4, 0)]],
    )
    assert result.mesh.object_id.tolist() == [0, 1]


def test_a_mesh_in_millimetres_is_told(capture, text_of_ply):
    capture.mesh(text_of_ply([(0, 0, 0), (5000, 0, 0), (0, 5000, 0)], [(0, 1, 2)], [0]))
    warned(capture, "metres")


# --- the objects


def test_faces_without_an_object(capture, text_of_ply):
    capture.mesh(text_of_ply([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)] * 4, [0, -1, 77, 1]))
    result = warned(capture, "2 of 4 triangles belong to no object")
    assert [(i.object_id, i.class_name) for i in result.instances] == [(0, "side 0"), (1, "side 1"), (6, "unlabelled")]
    assert result.mesh.object_id.tolist() == [0, 6, 6, 1]
    assert any("4 of the objects" in w and "2 (side 2)" in w for w in result.warnings)  # those without faces


def test_no_face_has_an_object(capture, text_of_ply):
    capture.mesh(text_of_ply([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], [-1]))
    assert [i.class_name for i in read_capture(capture.root).instances] == ["unlabelled"]


def test_no_list_of_objects(capture):
    (capture.root / "info_semantic.json").unlink()
    result = warned(capture, "no info_semantic.json")
    assert [i.class_name for i in result.instances] == [f"object_{i}" for i in range(6)]


def test_no_object_id(capture, text_of_ply):
    capture.mesh(text_of_ply([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
    result = warned(capture, "no object_id")
    assert [(i.object_id, i.class_name) for i in result.instances] == [(0, "room")]


def test_replicas_classes(capture):
    capture.objects(
        {"classes": [{"id": 5, "name": "sofa"}], "objects": [{"id": i, "class_id": 5 + (i > 2)} for i in range(6)]}
    )
    names = [i.class_name for i in read_capture(capture.root).instances]
    assert names == ["sofa"] * 3 + ["object_3", "object_4", "object_5"]


@pytest.mark.parametrize("value, words", [
    ({}, "no list 'objects'"), ({"objects": [{"class_name": "x"}]}, "without a whole 'id'"),
    ({"objects": [{"id": "1"}]}, "without a whole 'id'"), ({"objects": [3]}, "without a whole 'id'"),
    ({"objects": [{"id": 1}, {"id": 1}]}, "object 1 twice"), ([], "no JSON object"),
])  # fmt: skip
def test_objects_that_are_none(capture, value, words):
    capture.objects(value)
    refused(capture, words)


def test_an_object_is_called_what_can_be_shown_and_written(capture):
    names = ["half \ud83d", "two\nlines", "\x1b[31m red"]
    capture.objects({"objects": [{"id": i, "class_name": name} for i, name in enumerate(names)]})
    kinds = [one.class_name for one in read_capture(capture.root).instances][:3]
    assert kinds == ["half \ufffd", "two lines", "\ufffd[31m red"] and "".join(kinds).encode()


# --- the frames: one bad one is left out, many are not


def test_a_number_that_is_too_large_is_told_so(capture):
    capture.top(fl_x=1e300)
    refused(capture, "fl_x = 1e\\+300; give a number above 0 and below 1e300")


def test_a_missing_frame(capture):
    (capture.root / "images/004.exr").unlink()
    result = warned(capture, "1 of 10 frames are left out: Picture")
    assert [frame.name for frame in result.frames] == [f"{i:03d}" for i in range(10) if i != 4]


def test_a_cut_off_frame(capture):
    path = capture.root / "images/004.exr"
    path.write_bytes(path.read_bytes()[:-20])
    assert len(warned(capture, "004.exr' is cut off").frames) == 9


def test_a_frame_of_another_size(capture):
    capture.picture(4, np.ones((HEIGHT, WIDTH + 1, 3)))
    assert len(warned(capture, "has 9 x 6 pixels, but its camera has 8 x 6").frames) == 9


def test_a_frame_that_is_a_photograph(capture):
    write_png(capture.root / "images/004.exr", np.zeros((HEIGHT, WIDTH, 3), np.uint8))
    assert len(warned(capture, "holds 8 or 16-bit codes").frames) == 9


GOOD = np.eye(4)


def changed(*entries):
    pose = GOOD.copy()
    for row, column, value in entries:
        pose[row, column] = value
    return pose.tolist()


@pytest.mark.parametrize("pose, words", [
    (changed((0, 3, float("nan"))), "not finite"),
    (changed((1, 1, float("inf"))), "not finite"),
    (changed((0, 0, -1)), "mirrored"),
    ((GOOD * [2, 2, 2, 1]).tolist(), "not rigid"),
    (changed((0, 1, 0.3)), "not rigid"),
    (changed((0, 0, 1e200)), "not rigid"),
    (np.zeros((4, 4)).tolist(), "last row"),
    (changed((3, 0, 0.5)), "last row"),
    (changed((0, 3, 1e9)), "from the origin"),
    ([[1, 2], [3]], "no 4 x 4"),
    (GOOD[:2].tolist(), "no 4 x 4"),
    (None, "no 4 x 4"),
    ("here", "no 4 x 4"),
    ([["a"] * 4] * 4, "no 4 x 4"),
])  # fmt: skip
def test_a_pose_that_is_none(capture, pose, words):
    capture.frame(4, transform_matrix=pose)
    result = warned(capture, words)
    assert any("'004'" in warning for warning in result.warnings) and len(result.frames) == 9


def test_rounding_is_taken_out_of_a_pose(capture):
    capture.frame(
        4, transform_matrix=(np.array(capture.pose(4)) + np.array([[1e-4] * 3 + [0]] * 3 + [[0] * 4])).tolist()[:3]
    )
    pose = read_capture(capture.root).frames[4].camera.camera_to_world
    np.testing.assert_allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(pose, capture.pose(4), atol=5e-4)


@pytest.mark.parametrize("bad, passes", [(2, True), (3, False)])
def test_up_to_a_fifth_may_be_bad(capture, bad, passes):
    for i in range(bad):
        (capture.root / f"images/{i:03d}.exr").unlink()
    if passes:
        assert len(warned(capture, "2 of 10 frames").frames) == 8
    else:
        text = refused(capture, "3 bad frames of 10")
        assert all(f"{i:03d}.exr" in text for i in range(3))


def test_of_many_problems_the_first_are_told(capture):
    for i in range(2, 9):
        capture.frame(i, transform_matrix=None)
    (capture.root / "images/009.exr").unlink()
    text = refused(capture, "8 bad frames of 10")
    assert "'002'" in text and "'004'" in text and "'005'" not in text and "5 more" in text


def test_a_single_frame(make_capture):
    result = warned(make_capture(1), "single frame")
    assert len(result.frames) == 1


def test_a_single_bad_frame(make_capture):
    capture = make_capture(1)
    capture.frame(0, transform_matrix=changed((0, 0, -1)))
    refused(capture, "1 bad frames of 1.*mirrored")


# --- intrinsics


def test_intrinsics_of_each_frame(capture):
    capture.picture(2, np.ones((4, 4, 3)))
    capture.frame(2, w=4, h=4.0, fl_x=3, fl_y=5, cx=1, cy=2)
    camera = read_capture(capture.root).frames[2].camera
    assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (4, 4, 3, 5, 1, 2)


def test_an_angle_alone_as_in_the_synthetic_scenes(capture):
    top = {"camera_angle_x": np.pi / 2, "frames": capture.transforms["frames"]}
    for frame in top["frames"]:
        frame["file_path"] = "./" + frame["file_path"].removesuffix(".exr")
    capture.transforms = top
    capture.save()
    result = read_capture(capture.root)
    camera = result.frames[0].camera
    assert (camera.width, camera.height, camera.cx, camera.cy) == (8, 6, 4, 3)
    np.testing.assert_allclose([camera.fx, camera.fy], 4)
    assert len(result.frames) == 10


@pytest.mark.parametrize("model", ["VR180_L", 3])
@pytest.mark.parametrize("top", [True, False])
def test_unknown_lenses_are_refused(capture, model, top):
    capture.top(camera_model=model) if top else capture.frame(5, camera_model=model)
    assert "undistort" in refused(capture, f"camera model '{model}'")


def test_lenses_are_read(capture):
    """All kinds: tests/core/io/test_nerfstudio.py."""
    capture.top(k1=0.1)
    assert all(frame.camera.lens.numerator[0] == 0.1 for frame in read_capture(capture.root).frames)


@pytest.mark.parametrize("model", ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE"])
def test_lenses_without_distortion(capture, model):
    capture.top(camera_model=model, k1=0.0, k2=0, p1=-0.0, distortion_params=[0, 0])
    assert not read_capture(capture.root).warnings


@pytest.mark.parametrize(
    "values",
    [
        {"fl_x": 0},
        {"fl_x": "6"},
        {"w": 7.5},
        {"h": -6},
        {"cx": "middle"},
        {"exposure": 0},
        {"exposure": float("nan")},
        {"saturation": -1},
        {"fl_y": 1e999},
        {"camera_angle_x": 4},
        {"w": True},
    ],
)
def test_numbers_that_are_none(capture, values):
    capture.frame(4, **values)
    assert len(warned(capture, "'004'").frames) == 9


# --- paths


@pytest.mark.parametrize("path", ["", None, 3, "a\0b", "x" * 5000, "images"])
def test_paths_that_are_none(capture, path):
    capture.frame(7, file_path=path)
    assert len(warned(capture, "1 of 10 frames").frames) == 9


def test_a_frame_listed_twice(capture):
    capture.frame(7, file_path="images/006.exr")
    assert len(warned(capture, "listed twice").frames) == 9


def test_frames_of_one_name_in_two_folders(capture):
    (capture.root / "right").mkdir()
    (capture.root / "images/001.exr").rename(capture.root / "right/000.exr")
    capture.frame(1, file_path="right/000.exr")
    names = [frame.name for frame in read_capture(capture.root).frames]
    assert names[:2] == ["images/000.exr", "right/000.exr"]


# --- pixels


def pixels_of(capture, array, **values):
    capture.picture(0, array)
    capture.frame(0, **values)
    return read_pixels(read_capture(capture.root).frames[0])


def test_impossible_pixels(capture):
    picture = np.full((HEIGHT, WIDTH, 3), 2.0)
    picture[0, 0, 1] = np.nan
    picture[0, 1, 2] = np.inf
    picture[0, 2, 0] = -np.inf
    picture[0, 3, 0] = -0.5
    picture[0, 4, 0] = -5e-5
    pixels = pixels_of(capture, picture)
    assert pixels.valid[0].tolist() == [False] * 4 + [True] * 4 and pixels.valid[1:].all()
    assert pixels.saturated.nonzero() == ([0], [1])
    assert (pixels.radiance[~pixels.valid] == 0).all()
    assert pixels.radiance[0, 4].tolist() == [0, 2, 2] and (pixels.radiance[1:] == 2).all()


def test_all_nan(capture):
    pixels = pixels_of(capture, np.full((HEIGHT, WIDTH, 3), np.nan))
    assert not pixels.valid.any() and not pixels.radiance.any()


def test_exposure_and_saturation(capture):
    picture = np.full((HEIGHT, WIDTH, 3), 2.0)
    picture[0, 0, 0] = 4.0
    picture[0, 1, 0] = 3.99
    pixels = pixels_of(capture, picture, exposure=0.5, saturation=4.0)
    assert pixels.saturated.sum() == 1 and pixels.saturated[0, 0]
    assert pixels.valid.all() and pixels.radiance[0, 0].tolist() == [8, 4, 4]


def test_a_tiny_exposure_does_not_make_inf(capture):
    pixels = pixels_of(capture, np.full((HEIGHT, WIDTH, 3), 1e30), exposure=1e-30)
    assert np.isfinite(pixels.radiance).all() and not pixels.valid.any()


def test_alpha(capture):
    picture = np.full((HEIGHT, WIDTH, 4), 1.0)
    picture[:2, :, 3] = 0
    picture[2, :, 3] = 0.5
    assert pixels_of(capture, picture).valid.sum(1).tolist() == [0, 0, 0, 8, 8, 8]
    picture[..., 3] = 0  # says nothing
    assert pixels_of(capture, picture).valid.all()


@pytest.mark.parametrize("ending", ["png", "exr"])
def test_masks(capture, ending):
    mask = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    mask[:, 3:] = 255
    path = capture.root / f"mask.{ending}"
    write_png(path, mask) if ending == "png" else write_exr(path, mask)
    picture = np.full((HEIGHT, WIDTH, 3), np.inf)
    picture[1:] = 1
    pixels = pixels_of(capture, picture, mask_path=path.name)
    assert not pixels.valid[:, :3].any() and pixels.valid[1:, 3:].all()
    assert not pixels.saturated[:, :3].any() and pixels.saturated[0, 3:].all()


def test_bad_masks_cost_their_frame(capture):
    (capture.root / "a.jpg").write_bytes(b"\xff\xd8\xff\xe0 a photograph")
    capture.frame(0, mask_path="a.jpg")
    assert len(warned(capture, "a.jpg' is damaged").frames) == 9
    capture.frame(0, mask_path="absent.png")
    assert len(warned(capture, "absent.png' does not exist").frames) == 9
    write_png(capture.root / "small.png", np.zeros((2, 2, 3), np.uint8))
    capture.frame(0, mask_path="small.png")
    assert len(warned(capture, "has 2 x 2 pixels").frames) == 9


def test_a_picture_that_changes_during_the_run(capture):
    frame = read_capture(capture.root).frames[0]
    capture.picture(0, np.ones((3, 3, 3)))
    with pytest.raises(BadInputError, match="changed its size"):
        read_pixels(frame)


# --- what the rest asks for


def test_describe(capture):
    told = describe(read_capture(capture.root))
    assert (told["triangles"], told["frames"], told["resolutions"]) == (12, 10, {"8x6": 10})
    assert told["lenses"] == {"PINHOLE": 10}
    capture.frame(3, k1=0.1)
    assert describe(read_capture(capture.root))["lenses"] == {"PINHOLE": 9, "OPENCV": 1}
    assert told["extent_m"] == [5, 4, 3] and told["bounds_m"] == [[0, 0, 0], [5, 4, 3]]
    assert told["area_m2"] == pytest.approx(2 * (5 * 4 + 5 * 3 + 4 * 3))
    assert told["instances"][2] == {"object_id": 2, "class_name": "side 2", "triangles": 2}


def test_the_fingerprint_follows_what_matters(capture):
    def now():
        return fingerprint(read_capture(capture.root))

    seen = [now()]
    assert now() == seen[0]
    (capture.root / "README.md").write_text("no part of the capture")
    assert now() == seen[0]
    os.utime(capture.root / "images/003.exr", ns=(1, 1))
    seen.append(now())
    capture.frame(0, exposure=2.0)
    seen.append(now())
    capture.objects({"objects": []})
    seen.append(now())
    with open(capture.root / "mesh.ply", "a") as file:
        file.write("\n")
    assert now() == seen[-1]
    corners = [CORNERS[0], (5.5, 0, 0), *CORNERS[2:]]
    capture.mesh(ply_text(corners, SIDES, range(6)))
    seen.append(now())
    assert len(set(seen)) == len(seen)


def test_the_fingerprint_of_a_capture_that_goes_away(capture):
    result = read_capture(capture.root)
    (capture.root / "images/003.exr").unlink()
    with pytest.raises(BadInputError, match="003.exr"):
        fingerprint(result)


@pytest.mark.parametrize("size", [(1, 1), (640, 1)])
def test_frames_of_one_pixel_are_told_before_any_work(tmp_path, size):
    from tests.hostile.load import boxes, write

    with pytest.raises(BadInputError, match=f"{size[0]} x {size[1]} pixels, too few"):
        read_capture(write(tmp_path / "capture", boxes(3), 4, size))


@pytest.mark.parametrize("size", [(2, 2), (640, 2)])
def test_tiny_frames_and_strips_are_looked_at(tmp_path, size):
    from addon.core.agreement.look import look
    from addon.core.io.pixels import read_pixels
    from tests.hostile.load import boxes, write

    assert look(read_capture(write(tmp_path / "capture", boxes(3), 4, size)), read_pixels).sentence().endswith(".")


def test_parts_of_objects(capture):
    sides = [{"id": i, "class_name": f"side {i}"} for i in range(6)]
    sides[2]["part_of"] = sides[3]["part_of"] = 0
    capture.objects({"objects": sides})
    read = read_capture(capture.root)
    assert [instance.part_of for instance in read.instances] == [None, None, 0, 0, None, None]
    assert not any("part_of" in text for text in read.warnings)


@pytest.mark.parametrize("whole", [True, 1.0, "0", [0], 9, 2, 3], ids=str)
def test_a_part_of_nothing_whole_stays_an_object(capture, whole):
    """As are: no whole number, no object of the capture, itself, a part."""
    sides = [{"id": i, "class_name": f"side {i}"} for i in range(6)]
    sides[2]["part_of"], sides[3]["part_of"] = whole, 0
    capture.objects({"objects": sides})
    read = warned(
        capture, "'part_of' what is no whole object of the capture, and stay objects of their own: 2 (side 2)"
    )
    assert [instance.part_of for instance in read.instances] == [None, None, None, 0, None, None]
