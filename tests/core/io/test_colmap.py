"""COLMAP's models, text and binary, real and made; what is wrong with them is told in a sentence."""

import math
import shutil
import struct

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.colmap import frames_of, read
from addon.core.io.colmap_model import read_model
from addon.core.io.exr import write_exr
from addon.core.io.layout import AS_FOUND, Reading
from addon.core.io.read import read_capture
from addon.core.scene.lenses_polynomial import Polynomial
from tests.core.io.colmap_files import images_of, world_to_camera, write_binary, write_text

CAMERA = {1: ("PINHOLE", 8, 6, (6.0, 6.5, 4.0, 3.0))}
WRITERS = {"text": write_text, "binary": write_binary}


@pytest.fixture(params=["", "sparse/0", "sparse", "colmap/sparse/0"])
def place(request):
    return request.param


@pytest.fixture
def as_colmap(capture):
    """The good capture's poses to be written as a COLMAP model, its own file of them gone."""
    poses = [frame["transform_matrix"] for frame in capture.transforms["frames"]]
    (capture.root / "transforms.json").unlink()
    return capture, images_of(poses), [np.array(pose) for pose in poses]


@pytest.mark.parametrize("kind", WRITERS)
def test_the_same_frames_as_written(as_colmap, kind, place):
    capture, images, poses = as_colmap
    WRITERS[kind](capture.root / place, CAMERA, images)
    got = read_capture(capture.root)
    assert got.format == "colmap" and len(got.frames) == 10 and len(got.instances) == 6
    for frame, pose in zip(got.frames, poses):
        np.testing.assert_allclose(frame.camera.camera_to_world, pose, atol=1e-12)
        camera = frame.camera
        assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (8, 6, 6.0, 6.5, 4.0, 3.0)
        assert camera.lens is None and frame.path.is_file()
    assert len(got.warnings) == 1 and "no up" in got.warnings[0]


@pytest.mark.parametrize("scale", [1.0, -2.5, 1e-3, 1e200])
def test_quaternions_of_any_length(as_colmap, scale):
    capture, images, poses = as_colmap
    write_text(capture.root, CAMERA, [(n, [scale * v for v in q], *rest) for n, q, *rest in images])
    got = read_capture(capture.root)
    assert all(np.allclose(f.camera.camera_to_world, p, atol=1e-12) for f, p in zip(got.frames, poses))


def test_text_and_binary_agree(tmp_path):
    rng = np.random.default_rng(0)
    cameras = {3: ("OPENCV", 640, 480, (500.123456789012, 510.9, 320.1, 240.2, -0.1, 0.01, 0.001, -0.002)),
               9: ("OPENCV_FISHEYE", 800, 800, (300.0, 301.0, 400.5, 399.5, 0.01, -0.02, 0.003, 0.0)),
               4: ("EQUIRECTANGULAR", 400, 200, (400.0, 200.0))}  # fmt: skip
    images = [
        (i, rng.standard_normal(4), rng.standard_normal(3), list(cameras)[i % 3], f"left/a {i:02d}.exr")
        for i in range(1, 12)
    ]
    write_text(tmp_path / "text", cameras, images)
    write_binary(tmp_path / "binary", cameras, images)
    text, binary = (
        frames_of(read_model(tmp_path / kind), tmp_path, tmp_path, AS_FOUND)[0] for kind in ("text", "binary")
    )
    assert len(text) == len(binary) == 11
    for one, other in zip(text, binary):
        assert one.name == other.name and one.camera.lens == other.camera.lens
        np.testing.assert_allclose(one.camera.camera_to_world, other.camera.camera_to_world, atol=1e-9)
        assert one.camera.fx == other.camera.fx and one.camera.fy == other.camera.fy
    assert isinstance(text[0].camera.lens, Polynomial) or text[0].camera.lens.name == "EQUIRECTANGULAR"


def test_real_models(shared):
    """The photogrammetry importer's examples: one reconstruction in both encodings, and one with two pictures less."""
    found = {}
    for folder in sorted((shared / "data/colmap").iterdir()):
        if folder.is_dir():
            found[folder.name] = frames_of(read_model(folder), folder, folder / "images", AS_FOUND)
    binary, text, apart, missing = (
        found[f"colmap_example_model_{name}"]
        for name in ("bin", "txt", "not_shared_txt", "txt_missing_cams_and_subfolders")
    )
    assert [f.name for f in binary[0]] == [f.name for f in text[0]] and len(binary[0]) == len(apart[0]) == 11
    for one, other in zip(binary[0], text[0]):  # COLMAP writes six digits as text
        np.testing.assert_allclose(one.camera.camera_to_world, other.camera.camera_to_world, atol=1e-5)
        assert one.camera.fx == pytest.approx(other.camera.fx, rel=1e-5)
        assert one.camera.lens.numerator == pytest.approx(other.camera.lens.numerator, rel=1e-5)
    assert len({f.camera.fx for f in apart[0]}) == 11
    assert len(missing[0]) == 9 and {f.name.split("/")[0] for f in missing[0]} == {"sub1", "sub2"}
    assert not any(problems for _, problems, _ in found.values())
    assert "no pose for 2 of 11 pictures (numbers 5, 6)" in missing[2][0]
    for frame in binary[0]:  # a lens of this strength reaches all of the picture
        assert frame.camera.rays(np.array([[0.5, 0.5], [2831.5, 2127.5]]))[1].all()


def test_real_text_written_as_binary_agrees(shared, tmp_path):
    folder = shared / "data/colmap/colmap_example_model_txt"
    model = read_model(folder)
    write_binary(tmp_path, model.cameras, model.images)
    again = read_model(tmp_path)
    assert again.cameras == model.cameras and again.images == model.images


@pytest.mark.parametrize("kind", WRITERS)
def test_the_living_room_as_colmap(shared, tmp_path, kind):
    own = read_capture(shared / "captures/living-room")
    cameras = {1: ("PINHOLE", 320, 240, [getattr(own.frames[0].camera, n) for n in ("fx", "fy", "cx", "cy")])}
    images = [(i + 1, *world_to_camera(f.camera.camera_to_world), 1, f.path.name) for i, f in enumerate(own.frames)]
    WRITERS[kind](tmp_path / "sparse/0", cameras, images)
    (tmp_path / "images").symlink_to(shared / "captures/living-room/images")
    (tmp_path / "mesh.ply").symlink_to(shared / "captures/living-room/mesh.ply")
    (tmp_path / "info_semantic.json").symlink_to(shared / "captures/living-room/info_semantic.json")
    got = read_capture(tmp_path, Reading(outside=True))
    assert got.format == "colmap" and got.instances == own.instances
    for one, other in zip(got.frames, own.frames, strict=True):
        np.testing.assert_allclose(one.camera.camera_to_world, other.camera.camera_to_world, atol=1e-6)
        assert (one.camera.fx, one.camera.cy) == (other.camera.fx, other.camera.cy)


def test_images_without_lines_of_points(as_colmap):
    capture, images, _ = as_colmap
    write_text(capture.root, CAMERA, images, points="")
    whole = (capture.root / "images.txt").read_text()
    assert len(read_model(capture.root).images) == 10
    (capture.root / "images.txt").write_text("\n".join(line for line in whole.splitlines() if line.strip()) + "\n")
    assert len(read_model(capture.root).images) == 10


def test_a_camera_that_is_not_listed(as_colmap):
    capture, images, _ = as_colmap
    images[4] = (*images[4][:3], 7, images[4][4])
    write_text(capture.root, CAMERA, images)
    got = read_capture(capture.root)
    assert len(got.frames) == 9
    assert "Frame '004.exr' has camera 7, which" in got.warnings[1] and "cameras.txt" in got.warnings[1]


@pytest.mark.parametrize(("change", "words"), [
    ({"quaternion": [0.0, 0, 0, 0]}, "quaternion is 0"),
    ({"quaternion": [math.nan, 0, 0, 1]}, "not finite"),
    ({"translation": [0, math.inf, 0]}, "not finite"),
    ({"translation": [0, 1e9, 0]}, "from the origin"),
    ({"translation": [1e308, 1e308, 0]}, "from the origin"),
    ({"name": "000.exr"}, "listed twice"),
    ({"name": "gone.exr"}, "gone.exr"),
])  # fmt: skip
def test_a_bad_image_costs_its_frame(as_colmap, change, words):
    capture, images, _ = as_colmap
    number, quaternion, translation, camera, name = images[3]
    images[3] = (
        number,
        change.get("quaternion", quaternion),
        change.get("translation", translation),
        camera,
        change.get("name", name),
    )
    write_binary(capture.root, CAMERA, images)
    got = read_capture(capture.root)
    assert len(got.frames) == 9 and any(words in warning for warning in got.warnings)


@pytest.mark.parametrize(("line", "words"), [
    ("1 PINHOLE 8 6 6 6.5 4", "PINHOLE takes 4 parameters and 3"),
    ("1 KANNALA 8 6 6 6.5 4 3", "'KANNALA' is none of COLMAP's"),
    ("1 PINHOLE 8 0 6 6.5 4 3", "8 x 0"),
    ("1 PINHOLE 8 6 -6 6.5 4 3", "above 0"),
    ("1 PINHOLE 8 6 six 6.5 4 3", "no camera in line 1"),
    ("1 PINHOLE", "no camera in line 1"),
    ("", "does not list"),
])  # fmt: skip
def test_bad_cameras_are_told(as_colmap, line, words):
    capture, images, _ = as_colmap
    write_text(capture.root, CAMERA, images)
    (capture.root / "cameras.txt").write_text(line + "\n")
    with pytest.raises(BadInputError, match=words):
        read_capture(capture.root)


def test_lines_that_are_no_images(as_colmap):
    capture, images, _ = as_colmap
    write_text(capture.root, CAMERA, images)
    (capture.root / "images.txt").write_text("# comment\n\n1 0.5 nonsense\n\n")
    with pytest.raises(BadInputError, match="no image in line 3"):
        read_capture(capture.root)
    (capture.root / "images.txt").write_text("# none\n")
    with pytest.raises(BadInputError, match="lists no images"):
        read_capture(capture.root)


@pytest.mark.parametrize("name", ["cameras.bin", "images.bin"])
@pytest.mark.parametrize("count", [2**63, 2**32, 10**6])
def test_huge_counts_are_told(as_colmap, name, count):
    capture, images, _ = as_colmap
    write_binary(capture.root, CAMERA, images)
    data = (capture.root / name).read_bytes()
    (capture.root / name).write_bytes(struct.pack("<Q", count) + data[8:])
    with pytest.raises(BadInputError, match=f"claims {count}"):
        read_capture(capture.root)


def test_a_huge_count_of_points_and_an_endless_name(as_colmap):
    capture, images, _ = as_colmap
    write_binary(capture.root, CAMERA, images[:1])
    path = capture.root / "images.bin"
    data = path.read_bytes()
    end = 8 + 64 + len("000.exr") + 1
    path.write_bytes(data[:end] + struct.pack("<Q", 2**60) + data[end + 8 :])
    with pytest.raises(BadInputError, match="cut off in image 1"):
        read_model(capture.root)
    path.write_bytes(data[: 8 + 64] + b"x" * 100000)
    with pytest.raises(BadInputError, match="cut off in image 1"):
        read_model(capture.root)


@pytest.mark.parametrize("name", ["cameras.bin", "images.bin"])
def test_files_cut_off_anywhere(tmp_path, name):
    write_binary(tmp_path, {**CAMERA, 2: CAMERA[1]}, images_of([np.eye(4)] * 3))
    data = (tmp_path / name).read_bytes()
    for length in range(len(data)):
        (tmp_path / name).write_bytes(data[:length])
        with pytest.raises(BadInputError, match="cut off|more than"):
            read_model(tmp_path)


def test_damage_anywhere_is_told_or_harmless(tmp_path):
    images = images_of([np.eye(4)] * 3)
    rng = np.random.default_rng(1)
    told = 0
    for kind, writer in WRITERS.items():
        folder = tmp_path / kind
        for trial in range(150):
            writer(folder, CAMERA, images)
            path = sorted(folder.iterdir())[trial % 2]
            data = bytearray(path.read_bytes())
            for _ in range(3):
                data[rng.integers(len(data))] = rng.integers(256)
            path.write_bytes(data)
            try:
                frames, problems, _ = frames_of(read_model(folder), tmp_path, tmp_path, AS_FOUND)
                told += bool(problems)
                assert all(np.isfinite(f.camera.camera_to_world).all() for f in frames)
            except BadInputError:
                told += 1
    assert told > 50


def test_a_model_of_an_unknown_number(tmp_path):
    write_binary(tmp_path, CAMERA, images_of([np.eye(4)]))
    data = bytearray((tmp_path / "cameras.bin").read_bytes())
    data[12:16] = struct.pack("<i", 99)
    (tmp_path / "cameras.bin").write_bytes(data)
    with pytest.raises(BadInputError, match="model number 99"):
        read_model(tmp_path)


@pytest.mark.parametrize("name", ["../000.exr", "/etc/passwd", "C:\\000.exr", "a/../../000.exr"])
def test_paths_do_not_lead_out_unless_allowed(as_colmap, name):
    capture, images, _ = as_colmap
    images[0] = (*images[0][:4], name)
    write_text(capture.root, CAMERA, images)
    with pytest.raises(BadInputError, match="leads out"):
        read_capture(capture.root)


def test_a_path_that_may_lead_out(as_colmap, tmp_path_factory):
    capture, images, _ = as_colmap
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "far.exr"
    write_exr(elsewhere, np.ones((6, 8, 3), np.float32))
    images[0] = (*images[0][:4], str(elsewhere))
    write_text(capture.root, CAMERA, images)
    got = read_capture(capture.root, Reading(outside=True))
    assert len(got.frames) == 10 and elsewhere in [frame.path for frame in got.frames]


def test_folders_within_and_hdr_beside_copies(as_colmap):
    capture, images, _ = as_colmap
    for side in ("left", "right"):
        (capture.root / "images" / side).mkdir()
    for i, image in enumerate(images):
        side = "left" if i < 5 else "right"
        shutil.move(capture.root / f"images/{i:03d}.exr", capture.root / f"images/{side}/{i % 5:03d}.exr")
        images[i] = (*image[:4], f"{side}/{i % 5:03d}.jpg")  # COLMAP was run on tone-mapped copies
        (capture.root / f"images/{side}/{i % 5:03d}.jpg").write_bytes(b"a photograph")
    write_text(capture.root / "sparse", CAMERA, images)
    got = read_capture(capture.root)
    assert len(got.frames) == 10 and all(frame.path.suffix == ".exr" for frame in got.frames)
    assert [frame.name for frame in got.frames][4:6] == ["left/004.jpg", "right/000.jpg"]


def test_masks_beside_the_images(as_colmap):
    capture, images, _ = as_colmap
    (capture.root / "masks").mkdir()
    for i in range(10):
        write_exr(capture.root / f"masks/{i:03d}.exr", np.ones((6, 8, 3), np.float32))
    write_text(capture.root, CAMERA, images)
    layout = read(capture.root, AS_FOUND)
    assert all(frame.mask_path is None for frame in layout.frames)  # COLMAP's masks are PNGs
    (capture.root / "masks/003.exr.png").write_bytes(b"")
    layout = read(capture.root, AS_FOUND)
    assert [f.mask_path is not None for f in layout.frames] == [i == 3 for i in range(10)]


def test_meshes_of_the_dense_workspace(as_colmap):
    capture, images, _ = as_colmap
    write_text(capture.root / "sparse/0", CAMERA, images)
    mesh = capture.root / "mesh.ply"
    (capture.root / "dense").mkdir()
    mesh.rename(capture.root / "dense/meshed-poisson.ply")
    assert len(read_capture(capture.root).mesh.triangles) == 12
    (capture.root / "dense/meshed-poisson.ply").rename(capture.root / "dense/fused.ply")
    with pytest.raises(BadInputError, match="only the points of 'dense/fused.ply'"):
        read_capture(capture.root)
    got = read_capture(capture.root, Reading(mesh=capture.root / "dense/fused.ply"))  # the user knows better
    assert len(got.mesh.triangles) == 12


def test_models_apart_and_gaps_are_told(as_colmap):
    capture, images, _ = as_colmap
    images[5:] = [(number + 4, *rest) for number, *rest in images[5:]]
    write_binary(capture.root / "sparse/0", CAMERA, images)
    write_binary(capture.root / "sparse/1", CAMERA, images[:2])
    warnings = " ".join(read_capture(capture.root).warnings)
    assert "2 models that don't hang together" in warnings
    assert "no pose for 4 of 14 pictures (numbers 6, 7, 8, 9)" in warnings


def test_rigs_and_points_are_not_looked_at(as_colmap):
    capture, images, _ = as_colmap
    write_binary(capture.root / "sparse/0", CAMERA, images)
    for name in ("rigs.bin", "frames.bin", "points3D.bin", "project.ini"):
        (capture.root / "sparse/0" / name).write_bytes(b"\xff" * 100)
    assert len(read_capture(capture.root).frames) == 10


def test_poses_of_nerfstudio_come_first(capture):
    images = images_of([np.eye(4)] * 2)
    write_binary(capture.root / "colmap/sparse/0", CAMERA, images)
    assert read_capture(capture.root).format == "nerfstudio"
    assert read_capture(capture.root, Reading(format="colmap")).format == "colmap"
