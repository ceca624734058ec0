"""nerfstudio's keys: intrinsics, lenses, splits, the world that poses and mesh are in."""

import json
import math

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import write_exr
from addon.core.io.layout import AS_FOUND, Reading
from addon.core.io.nerfstudio import applied, read_frames
from addon.core.io.pixels import read_pixels
from addon.core.io.read import read_capture
from addon.core.scene.lenses import Cropped, Equirectangular

TURNED = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]])
"""What nerfstudio does to COLMAP's world today."""


def frames_of(capture, reading=AS_FOUND):
    return read_capture(capture.root, reading).frames


def moved(capture, matrix, scale=1.0):
    """The capture's poses as nerfstudio would have stored them."""
    for frame in capture.transforms["frames"]:
        pose = np.vstack([matrix, [0, 0, 0, 1]]) @ np.array(frame["transform_matrix"])
        pose[:3, 3] *= scale
        frame["transform_matrix"] = pose.tolist()
    capture.save()


# --- lenses


def nerfstudio_distorts(x, y, k1, k2, k3, k4, p1, p2):
    """As cameras/camera_utils.py tells."""
    r = x * x + y * y
    d = 1 + r * (k1 + r * (k2 + r * (k3 + r * k4)))
    return x * d + 2 * p1 * x * y + p2 * (r + 2 * x * x), y * d + 2 * p2 * x * y + p1 * (r + 2 * y * y)


K = {"k1": -0.2, "k2": 0.05, "k3": -0.01, "k4": 0.002, "p1": 0.003, "p2": -0.002}


@pytest.mark.parametrize("where", ["top", "frame", "top list", "frame list"])
def test_perspective_distortion_is_nerfstudios(capture, where):
    values = K if "list" not in where else {"distortion_params": list(K.values())}
    capture.top(camera_model="OPENCV")
    if where.startswith("top"):
        capture.top(**values)
    else:
        capture.frame(3, **values)
    camera = frames_of(capture)[3].camera
    x, y = 0.4, -0.25
    u, v = nerfstudio_distorts(x, y, *K.values())
    pixels, depth = camera.project(camera.centre + (np.array([x, -y, -1]) @ camera.camera_to_world[:3, :3].T)[None])
    np.testing.assert_allclose(pixels[0], [6.0 * u + 4, 6.5 * v + 3], atol=1e-9)
    assert depth[0] > 0
    assert (frames_of(capture)[2].camera.lens is None) == where.startswith("frame")


def test_fisheye_is_nerfstudios(capture):
    capture.top(camera_model="OPENCV_FISHEYE", **K)
    camera = frames_of(capture)[0].camera
    theta, phi = 1.2, 0.7
    u, v = nerfstudio_distorts(theta * math.cos(phi), theta * math.sin(phi), *K.values())
    ray = np.array([math.sin(theta) * math.cos(phi), -math.sin(theta) * math.sin(phi), -math.cos(theta)])
    pixels, _ = camera.project(camera.centre + (2 * ray @ camera.camera_to_world[:3, :3].T)[None])
    np.testing.assert_allclose(pixels[0], [6.0 * u + 4, 6.5 * v + 3], atol=1e-9)


def test_panoramas(capture):
    capture.transforms.update(camera_model="EQUIRECTANGULAR", fl_x=4.0, fl_y=4.0)
    capture.transforms["h"] = 4
    capture.save()
    for i in range(10):
        capture.picture(i, np.full((4, 8, 3), 0.5))
    capture.top(cy=2.0)
    camera = frames_of(capture)[0].camera
    assert camera.lens == Equirectangular()
    assert camera.fx == pytest.approx(8 / 2 / math.pi) and camera.fy == pytest.approx(4 / math.pi)
    right = camera.centre + camera.camera_to_world[:3, 0]
    np.testing.assert_allclose(camera.project(right[None])[0][0], [6, 2], atol=1e-9)
    for key in ("fl_x", "fl_y"):
        del capture.transforms[key]
    capture.save()
    assert frames_of(capture)[0].camera.fx == pytest.approx(camera.fx)


def test_arias_lenses(capture):
    values = [-0.024, 0.1, -0.07, 0.012, 0.001, -0.0003, -0.004, 0.003, 0.002, -0.0003, 0.001, 0.0001]
    capture.top(camera_model="FISHEYE624", fisheye_crop_radius=3.0)
    for i in range(10):
        capture.frame(i, distortion_params=values)
    lens = frames_of(capture)[0].camera.lens
    assert lens.lens.numerator == tuple(values[:6]) and lens.lens.tangential == (0.003, -0.004) and lens.lens.chained
    capture.frame(4, distortion_params=values[:6])
    assert any("takes 12" in warning for warning in read_capture(capture.root).warnings)


def test_a_crop_ends_the_picture(capture):
    capture.top(camera_model="OPENCV_FISHEYE", fisheye_crop_radius=2.6, fl_y=6.0)
    frame = frames_of(capture)[0]
    assert isinstance(frame.camera.lens, Cropped)
    y, x = np.mgrid[0.5:6, 0.5:8]
    assert np.array_equal(read_pixels(frame).valid, np.hypot(x - 4, y - 3) <= 2.6)
    capture.top(camera_model="OPENCV")  # nerfstudio heeds it for fisheyes alone
    assert frames_of(capture)[0].camera.lens is None


@pytest.mark.parametrize(("values", "words"), [
    ({"k1": "strong"}, "k1"), ({"k1": math.inf}, "k1"), ({"distortion_params": [0.1, 0.2]}, "give six"),
    ({"distortion_params": "none"}, "no list of numbers"),
])  # fmt: skip
def test_lenses_that_are_none_cost_their_frame(capture, values, words):
    capture.frame(4, **values)
    got = read_capture(capture.root)
    assert len(got.frames) == 9 and any(words in warning for warning in got.warnings)


def test_what_k4_was_taken_for_is_told(capture):
    capture.top(k1=0.1, k4=0.01)
    assert any("r^8" in warning for warning in read_capture(capture.root).warnings)
    capture.top(k5=0.02)
    got = read_capture(capture.root)
    assert any("rational" in warning for warning in got.warnings)
    assert got.frames[0].camera.lens.denominator == (0.01, 0.02, 0.0)
    capture.top(camera_model="FULL_OPENCV")
    assert not read_capture(capture.root).warnings


def test_a_fisheye_needs_a_focal_length(capture):
    capture.transforms.update(camera_model="OPENCV_FISHEYE", camera_angle_x=1.5)
    for key in ("fl_x", "fl_y"):
        del capture.transforms[key]
    capture.save()
    with pytest.raises(BadInputError, match="give fl_x"):
        read_capture(capture.root)


# --- which frames


def test_test_frames_are_left_out(capture):
    names = [frame["file_path"] for frame in capture.transforms["frames"]]
    capture.top(train_filenames=names[:6], val_filenames=names[6:8], test_filenames=["./" + n for n in names[7:]])
    got = read_capture(capture.root)
    assert [frame.name for frame in got.frames] == [f"{i:03d}" for i in range(7)]
    assert "3 of 10 frames are listed in 'test_filenames'" in got.warnings[0]
    capture.top(train_filenames=names, val_filenames=names)  # one list for all
    assert len(frames_of(capture)) == 10


def test_split_files(capture):
    frames = capture.transforms.pop("frames")
    (capture.root / "transforms.json").unlink()
    angle = {"camera_angle_x": 1.1}
    for name, part in (("train", frames[:6]), ("val", frames[6:8]), ("test", frames[8:])):
        (capture.root / f"transforms_{name}.json").write_text(json.dumps(angle | {"frames": part}))
    got = read_capture(capture.root)
    assert [frame.name for frame in got.frames] == [f"{i:03d}" for i in range(8)]
    assert "transforms_test.json" in got.warnings[0] and got.format == "nerfstudio"
    (capture.root / "transforms_train.json").unlink()
    with pytest.raises(BadInputError, match="lists no frames"):
        (capture.root / "transforms_val.json").write_text("{}")
        read_capture(capture.root)


def test_real_split_files(shared, tmp_path):
    """Two files of the NeRF-synthetic scenes; their pictures, 800 x 800, are not with them."""
    for name in ("transforms_train.json", "transforms_val.json"):
        (tmp_path / name).write_text((shared / "data/nerfstudio" / name).read_text())
    frames, problems, _ = read_frames(tmp_path, AS_FOUND)
    assert not frames and len(problems) == 2
    for split in ("train", "val"):
        (tmp_path / split).mkdir()
        write_exr(tmp_path / split / "r_0.exr", np.zeros((8, 8, 3), np.float32))
    frames, problems, _ = read_frames(tmp_path, AS_FOUND)
    assert [frame.name for frame in frames] == ["./train/r_0", "./val/r_0"] and not problems
    for frame, split in zip(frames, ("train", "val")):
        stored = json.loads((shared / f"data/nerfstudio/transforms_{split}.json").read_text())
        np.testing.assert_allclose(frame.camera.camera_to_world, stored["frames"][0]["transform_matrix"], atol=1e-6)
        assert frame.camera.fx == pytest.approx(4 / math.tan(stored["camera_angle_x"] / 2))
        assert np.linalg.norm(frame.camera.centre) == pytest.approx(4.031, abs=1e-3)  # on the scenes' sphere


# --- paths


def test_paths_may_lead_out_when_allowed(capture, tmp_path_factory):
    far = tmp_path_factory.mktemp("far")
    write_exr(far / "a.exr", np.ones((6, 8, 3), np.float32))
    write_exr(far / "mask.exr", np.ones((6, 8, 3), np.float32))
    capture.frame(0, file_path=str(far / "a.exr"), mask_path=str(far / "mask.exr"))
    capture.frame(1, file_path="../capture/images/001.exr")
    with pytest.raises(BadInputError, match="--outside"):
        read_capture(capture.root)
    got = read_capture(capture.root, Reading(outside=True))
    assert len(got.frames) == 10 and got.frames[0].path == far / "a.exr" and got.frames[0].mask_path is not None


def test_depth_is_not_looked_at(capture):
    capture.frame(0, depth_file_path="../../nowhere.png")
    assert len(frames_of(capture)) == 10


# --- worlds


def test_a_moved_world_is_told(capture):
    capture.top(applied_transform=[[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0]], orientation_override="up")
    warnings = read_capture(capture.root).warnings
    assert any("taken to have been moved" in warning for warning in warnings)
    assert any("'orientation_override' is 'up'" in warning for warning in warnings)
    capture.top(applied_transform=np.eye(4)[:3].tolist(), applied_scale=1, orientation_override="none")
    assert not read_capture(capture.root).warnings


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_a_mesh_of_the_original_world_follows_the_poses(capture, scale):
    plain = read_capture(capture.root)
    moved(capture, TURNED, scale)
    capture.top(applied_transform=TURNED.tolist(), applied_scale=scale)
    got = read_capture(capture.root)
    assert any(
        "moved from the original world" in warning and "100% of the cameras" in warning for warning in got.warnings
    )
    np.testing.assert_allclose(got.mesh.vertices, scale * plain.mesh.vertices @ TURNED[:, :3].T, atol=1e-12)
    for frame, before in zip(got.frames, plain.frames):
        back = TURNED[:, :3].T @ frame.camera.centre / scale
        np.testing.assert_allclose(back, before.camera.centre, atol=1e-6)
        np.testing.assert_allclose(TURNED[:, :3].T @ frame.camera.camera_to_world[:3, :3],
                                   before.camera.camera_to_world[:3, :3], atol=1e-6)  # fmt: skip
    stays = read_capture(capture.root, Reading(convention="as-read"))
    np.testing.assert_allclose(stays.mesh.vertices, plain.mesh.vertices)


def test_a_mesh_of_the_poses_world_stays(capture, text_of_ply):
    plain = read_capture(capture.root)
    moved(capture, TURNED)
    capture.top(applied_transform=TURNED.tolist())
    vertices = plain.mesh.vertices @ TURNED[:, :3].T
    capture.mesh(text_of_ply(vertices.tolist(), plain.mesh.triangles.tolist(), plain.mesh.object_id.tolist()))
    np.testing.assert_allclose(read_capture(capture.root).mesh.vertices, vertices, atol=1e-6)


def test_files_from_before_applied_transform(capture):
    before = np.array([[0.0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0]])
    assert applied(capture.root, {}) is None
    (capture.root / "colmap/sparse/0").mkdir(parents=True)
    np.testing.assert_array_equal(applied(capture.root, {})[:3], before)
    moved(capture, before)
    assert any("moved from the original world" in warning for warning in read_capture(capture.root).warnings)


@pytest.mark.parametrize(
    "values",
    [
        {"applied_transform": [[1, 0], [0, 1]]},
        {"applied_transform": "up"},
        {"applied_scale": 0},
        {"applied_scale": "2"},
        {"applied_transform": [[1, 0, 0, math.nan], [0, 1, 0, 0], [0, 0, 1, 0]]},
        {"applied_transform": [[10**400, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]},
    ],
)
def test_worlds_that_are_none(capture, values):
    capture.top(**values)
    with pytest.raises(BadInputError, match="applied_"):
        read_capture(capture.root)


def test_a_mesh_named_in_the_file(capture):
    (capture.root / "mesh.ply").rename(capture.root / "images/room.ply")
    with pytest.raises(BadInputError, match=r"mesh\.ply"):
        read_capture(capture.root)
    capture.top(ply_file_path="images/room.ply")
    assert len(read_capture(capture.root).mesh.triangles) == 12


@pytest.mark.slow
def test_the_living_room_in_other_words(shared, tmp_path):
    """Split files, a moved world and per-frame intrinsics give the poses that the plain file gives."""
    folder = shared / "captures/living-room"
    plain = read_capture(folder)
    top = json.loads((folder / "transforms.json").read_text())
    for name in ("images", "mesh.ply", "info_semantic.json"):
        (tmp_path / name).symlink_to(folder / name)
    own = {key: top.pop(key) for key in ("w", "h", "fl_x", "fl_y", "cx", "cy")}
    frames = top.pop("frames")
    for frame in frames:
        frame.update(own)
    (tmp_path / "transforms_train.json").write_text(json.dumps({**top, "frames": frames[:90]}))
    (tmp_path / "transforms_val.json").write_text(json.dumps({**top, "frames": frames[90:]}))
    got = read_capture(tmp_path, Reading(outside=True))
    for one, other in zip(got.frames, plain.frames, strict=True):
        np.testing.assert_allclose(one.camera.camera_to_world, other.camera.camera_to_world, atol=1e-6)
        assert one.camera.fx == other.camera.fx and one.path.name == other.path.name

    matrix = np.vstack([TURNED, [0, 0, 0, 1]])
    for frame in frames:
        frame["transform_matrix"] = (matrix @ np.array(frame["transform_matrix"])).tolist()
    told = {**top, "frames": frames, "applied_transform": TURNED.tolist()}
    (tmp_path / "transforms.json").write_text(json.dumps(told))
    got = read_capture(tmp_path, Reading(outside=True))
    np.testing.assert_allclose(got.mesh.vertices @ TURNED[:, :3], plain.mesh.vertices, atol=1e-6)
    for one, other in zip(got.frames, plain.frames, strict=True):
        np.testing.assert_allclose(matrix.T @ one.camera.camera_to_world, other.camera.camera_to_world, atol=1e-6)
