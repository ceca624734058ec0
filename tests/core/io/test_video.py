"""Frames of a phone's video: the right ones with their poses, the light that was recorded, and what is wrong."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from addon.core.errors import BadInputError, StorageError
from addon.core.io import video
from addon.core.io.folder import CAPTURE, look_into, of_path
from addon.core.io.layout import Reading
from addon.core.io.pictures import read_picture
from addon.core.io.pixels import read_pixels
from addon.core.io.read import read_capture
from tests.core.io.conftest import CaptureOnDisk
from tests.core.io.hostile.cases import Y_UP, mesh_only, turn_mesh, write_odometry
from tests.core.io.video_files import HEIGHT, WIDTH, grey, write_video

LENS = 60.0, 61.0, 33.0, 23.0
HLG = {"color_trc": 18, "color_primaries": 9, "colorspace": 9}


def write_recording(root, luma, **how):
    """A recording whose frames are of these levels of Y', one each."""
    pytest.importorskip("av")
    mesh_only(root)
    turn_mesh(root, Y_UP)
    write_video(root / "rgb.mp4", [grey(y) for y in luma], **how)
    write_odometry(root / "odometry.csv", [np.array(CaptureOnDisk.pose(i)) for i in range(len(luma))], LENS)
    return root


@pytest.fixture
def recording(tmp_path):
    """Ten frames, the first before time 0, as Apple's writer begins, with others between those that they refer to."""
    return write_recording(tmp_path / "scan", range(30, 230, 20), first=-1)


def frames(path, windows, curve="srgb"):
    return {number: read_picture(one, curve).rgb for number, one in video.frames(path, windows).items()}


def undone(y):
    """Scene light of BT.709's luma in limited range."""
    code = (y - 16) / 219
    return code / 4.5 if code < 0.081 else ((code + 0.099) / 1.099) ** (1 / 0.45)


def test_each_pose_has_its_frame(recording):
    found = read_capture(recording, Reading(transfer="srgb"))
    assert found.format == "stray" and [frame.name for frame in found.frames] == [f"{i:06d}" for i in range(10)]
    for i, frame in enumerate(found.frames):
        np.testing.assert_allclose(frame.camera.camera_to_world, CaptureOnDisk.pose(i), atol=1e-6)
        camera = frame.camera
        assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (WIDTH, HEIGHT, *LENS)
        np.testing.assert_allclose(read_pixels(frame).radiance, undone(30 + 20 * i), atol=0.006)
    assert any("10 of 10 frames are used" in one for one in found.warnings)


def test_one_camera_for_all_as_older_versions_have_it(recording):
    lines = (recording / "odometry.csv").read_text().splitlines()
    old = [", ".join(line.split(", ")[2:9]) for line in lines]  # neither times nor numbers
    (recording / "odometry.csv").write_text("\n".join(old))
    (recording / "camera_matrix.csv").write_text("60.0, 0.0, 33.0\n0.0, 61.0, 23.0\n0.0, 0.0, 1.0")
    found = read_capture(recording)
    assert found.frames[9].camera.fy == 61 and len(found.frames) == 10
    (recording / "camera_matrix.csv").unlink()
    with pytest.raises(BadInputError, match="camera isn't told"):
        read_capture(recording)


def test_of_a_long_recording_the_sharpest_of_each_part(tmp_path, monkeypatch):
    pytest.importorskip("av")
    sharp = {2, 6, 11}
    planes = [grey(126) for _ in range(13)]
    for i, (y, _, _) in enumerate(planes):
        y[:, 20:40] += 8 if i not in sharp else np.where(np.arange(20) // 2 % 2, 40, -20)
    write_video(tmp_path / "a.mp4", planes)
    assert set(frames(tmp_path / "a.mp4", np.array_split(np.arange(12), 3))) == sharp
    monkeypatch.setattr("addon.core.io.stray.MAX_FRAMES", 4)
    found = read_capture(write_recording(tmp_path / "scan", range(30, 200, 10)))
    assert len(found.frames) == 4 and any("4 of 17 frames are used" in one for one in found.warnings)


@pytest.mark.parametrize(
    "yuv, how, light",
    [
        ((126, 128, 128), {}, undone(126)),
        ((126, 128, 128), {"color_trc": 2, "color_primaries": 2, "colorspace": 2}, undone(126)),
        ((128, 128, 128), {"color_range": 2}, undone(16 + 219 * 128 / 255)),
        ((128, 128, 128), {"color_trc": 13, "color_range": 2}, 0.2158),
        ((110, 110, 160), {}, [0.4319, 0.1561, 0.0939]),
        ((110, 110, 160), {"colorspace": 6}, [0.4010, 0.1401, 0.0977]),
        ((400, 512, 512), {"bits": 10, **HLG}, 0.0490),
        ((721, 512, 512), {"bits": 10, **HLG}, 0.2650),
        ((400, 480, 560), {"bits": 10, **HLG}, [0.0908, 0.0395, 0.0317]),
    ],
)
def test_the_light_that_was_recorded(tmp_path, yuv, how, light):
    pytest.importorskip("av")
    write_video(tmp_path / "a.mp4", [grey(*yuv)] * 4, **how)
    (found,) = frames(tmp_path / "a.mp4", [np.arange(4)]).values()
    np.testing.assert_allclose(found, np.broadcast_to(light, found.shape), atol=0.003 if "bits" not in how else 2e-4)


@pytest.mark.parametrize("how", [{}, {"bits": 10, **HLG}])
def test_what_is_white_clips(tmp_path, how):
    white = 940 if how else 235
    found = read_capture(write_recording(tmp_path / "scan", [white, white * 3 // 4], **how))
    assert [read_pixels(frame).saturated.all() for frame in found.frames] == [True, False]


def test_frames_are_taken_out_once(recording, monkeypatch):
    read_capture(recording)
    monkeypatch.setitem(sys.modules, "av", None)
    assert len(read_capture(recording).frames) == 10
    (recording / "rgb.mp4").write_bytes(b"another")
    with pytest.raises(BadInputError, match=r"rgb.mp4.*PyAV; install it \(pip: av\)"):
        read_capture(recording)


def test_each_file_of_it_leads_to_the_recording(recording):
    for name in ("rgb.mp4", "odometry.csv"):
        assert of_path(recording / name) == look_into(recording) and look_into(recording).kind == CAPTURE


# --- What is wrong


def test_a_video_alone_says_what_is_missing(capture, tmp_path):
    (tmp_path / "film").mkdir()
    (tmp_path / "film/IMG_1.MOV").write_bytes(b"film")
    assert "'IMG_1.MOV', which has no poses" in look_into(tmp_path / "film").sentence
    for path in (capture.root / "images").iterdir():
        path.unlink()
    (capture.root / "walk.mp4").write_bytes(b"film")
    with pytest.raises(BadInputError, match="don't tell which frames of 'walk.mp4' they are of"):
        read_capture(capture.root)


def spoiled(recording, name):
    path = recording / "rgb.mp4"
    good = path.read_bytes()
    if name == "front":  # its index comes first, and its end is missing
        write_video(path, [grey(y) for y in range(30, 230, 20)], movflags="faststart")
        good = path.read_bytes()
        path.write_bytes(good[: good.index(b"mdat") + 400])
    elif name == "turned":
        write_video(path, [[plane.T for plane in grey(y)] for y in range(30, 230, 20)])
    elif name in ("short", "mpeg4", "pq"):
        how = {"mpeg4": {"codec": "mpeg4"}, "pq": {"color_trc": 16}}.get(name, {})
        write_video(path, [grey(y) for y in range(30, 150 if name == "short" else 230, 20)], **how)
    else:
        other = recording / "secret.mp4"
        other.write_bytes(good)
        path.write_bytes({
            "empty": b"", "cut": good[: len(good) // 2], "list": f"#EXTM3U\n#EXTINF:1,\n{other}\n".encode(),
            "concat": f"ffconcat version 1.0\nfile {other}\n".encode(),
            "picture": b"\x89PNG\r\n\x1a\n" + good,
        }[name])  # fmt: skip


@pytest.mark.parametrize(
    "name, words",
    [
        ("empty", "damaged or cut off"),
        ("cut", "damaged or cut off"),
        ("front", "has [0-9] frames, and 10 have poses"),
        ("short", "has 6 frames, and 10 have poses"),
        ("list", "damaged or cut off"),
        ("concat", "damaged or cut off"),
        ("picture", "damaged or cut off"),
        ("mpeg4", "no H.264 or HEVC"),
        ("pq", "transfer 16"),
        ("turned", "48 x 64 pixels, and its camera's centre is 33, 23"),
    ],
)
def test_bad_videos(recording, name, words):
    spoiled(recording, name)
    with pytest.raises(BadInputError, match=f"rgb.mp4.*{words}"):
        read_capture(recording)
    assert name == "turned" or [path.name for path in recording.iterdir() if path.is_dir()] == ["images"]


def test_a_video_that_claims_too_much(recording, monkeypatch):
    monkeypatch.setattr(video, "DENSE", (1000, 1))
    with pytest.raises(BadInputError, match="claims more frames than it can hold"):
        read_capture(recording)
    monkeypatch.setattr("addon.core.io.picture.MAX_PIXELS", 1000)
    with pytest.raises(BadInputError, match="claims 64 x 48 pixels"):
        read_capture(recording)


def test_a_video_that_is_a_link_out(recording, tmp_path):
    (recording / "rgb.mp4").rename(tmp_path / "other.mp4")
    (recording / "rgb.mp4").symlink_to(tmp_path / "other.mp4")
    with pytest.raises(BadInputError, match="rgb.mp4' is a link"):
        read_capture(recording)
    assert len(read_capture(recording, Reading(outside=True)).frames) == 10


def test_no_place_for_the_frames(recording):
    path = recording / "rgb.mp4"
    path.with_name(f"rgb.mp4-{path.stat().st_size}").write_text("in the way")
    with pytest.raises(StorageError, match="can't be put beside it"):
        read_capture(recording)


@pytest.mark.parametrize(
    "old, new, words",
    [
        (", 2.5, ", ", x, ", "bad frames of 10.*no quaternion"),
        ("qx", "rx", "lists no poses"),
        ("timestamp, frame", "time, stamp", ""),
        ("00000", "-1, 00000", "lists no poses"),
    ],
)
def test_bad_poses(recording, old, new, words):
    path = recording / "odometry.csv"
    path.write_text(path.read_text().replace(old, new))
    if not words:
        assert len(read_capture(recording).frames) == 10
        return
    with pytest.raises(BadInputError, match=words):
        read_capture(recording)
