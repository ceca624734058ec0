"""Polycam's and Record3D's folders as they come off a phone: the same capture comes out."""

from __future__ import annotations

import json

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.folder import CAPTURE, of_path
from addon.core.io.pixels import read_pixels
from addon.core.io.read import read_capture
from addon.core.results.room_file import read_capture_file, write_room
from tests.core.io.conftest import CORNERS, JPEG, CaptureOnDisk
from tests.core.io.hostile import cases


def change(path, **values):
    path.write_text(json.dumps(json.loads(path.read_text()) | values))


@pytest.fixture(params=["polycam", "record3d", "stray"])
def export(request, tmp_path):
    getattr(cases, request.param)(tmp_path / "scan")
    return request.param, tmp_path / "scan"


@pytest.fixture
def polycam(tmp_path):
    cases.polycam(tmp_path / "scan")
    return tmp_path / "scan"


@pytest.fixture
def recording(tmp_path):
    cases.record3d(tmp_path / "scan")
    return tmp_path / "scan"


def test_the_room_stands_upright_and_cameras_are_in_it(export):
    name, root = export
    found = read_capture(root)
    assert found.format == name and len(found.frames) == cases.COUNT
    for i, frame in enumerate(found.frames):
        np.testing.assert_allclose(frame.camera.camera_to_world, CaptureOnDisk.pose(i), atol=1e-6)
        camera = frame.camera
        assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (8, 6, 6, 6.5, 4, 3)
    np.testing.assert_allclose(found.mesh.vertices[found.mesh.triangles].reshape(-1, 3).min(0), 0, atol=1e-6)
    np.testing.assert_allclose(found.mesh.vertices.max(0), np.max(CORNERS, 0), atol=1e-6)
    assert read_pixels(found.frames[0]).radiance.any()


def test_without_a_mesh_it_says_what_to_export(export):
    _, root = export
    (root / "mesh.ply").unlink()
    with pytest.raises(BadInputError, match="has no mesh; .*(GLTF|fuse)"):
        read_capture(root)


def test_a_chosen_file_leads_to_the_export(polycam, tmp_path):
    assert of_path(polycam / "mesh_info.json").folder == polycam
    cases.record3d(tmp_path / "other")
    (tmp_path / "other/metadata").rename(tmp_path / "other/metadata.json")
    assert of_path(tmp_path / "other/metadata.json").kind == CAPTURE


# --- Polycam


def test_blurred_frames_are_passed_over(polycam):
    change(polycam / "keyframes/corrected_cameras/1002.json", blur_score=12.5)
    found = read_capture(polycam)
    assert [frame.name for frame in found.frames] == ["1000", "1001", "1003"]
    assert any("1 of 4 frames are blurred" in one and "1002" in one for one in found.warnings)


def test_where_most_are_blurred_none_is_passed_over(polycam):
    for i in (1000, 1001, 1002):
        change(polycam / f"keyframes/corrected_cameras/{i}.json", blur_score=12.5)
    found = read_capture(polycam)
    assert len(found.frames) == 4 and not any("blurred" in one for one in found.warnings)


def test_the_black_border_of_undistortion_says_nothing(polycam, tmp_path):
    for file in (polycam / "keyframes/corrected_cameras").iterdir():
        change(file, width=200, height=100, fx=150.0, fy=150.0, cx=100.0, cy=50.0)
    image = pytest.importorskip("PIL.Image")
    for file in (polycam / "keyframes/corrected_images").iterdir():
        image.fromarray(np.full((100, 200, 3), 128, np.uint8)).save(file)
    found = read_capture(polycam)
    valid = read_pixels(found.frames[0]).valid
    assert valid[3:-3, 3:-3].all() and valid.sum() == 94 * 194
    write_room(tmp_path, found)
    assert read_capture_file(tmp_path)[0].frames[0].margin == 3


def test_arkits_own_cameras_where_none_are_corrected(tmp_path):
    cases.polycam(tmp_path / "scan", corrected=False)
    found = read_capture(tmp_path / "scan")
    assert found.frames[0].margin == 0 and any("drift" in one for one in found.warnings)
    np.testing.assert_allclose(found.frames[2].camera.camera_to_world, CaptureOnDisk.pose(2), atol=1e-6)


@pytest.mark.parametrize("told", [[1, 2], "no", [0.0] * 16, [2.0, *[0.0] * 15], [[1, 0], [0, 1]]])
def test_an_alignment_that_is_none(polycam, told):
    change(polycam / "mesh_info.json", alignmentTransform=told)
    with pytest.raises(BadInputError, match="mesh_info.json.*alignmentTransform"):
        read_capture(polycam)


def test_a_mesh_that_was_not_moved(polycam):
    change(polycam / "mesh_info.json", alignmentTransform=None)
    cases.turn_mesh(polycam, cases.Y_UP)
    assert read_capture(polycam).mesh.vertices.max(0) == pytest.approx(np.max(CORNERS, 0))


# --- Record3D


def test_the_folder_of_exr_and_rgb(recording):
    (recording / "metadata").rename(recording / "metadata.json")
    (recording / "rgbd").rename(recording / "rgb")
    change(recording / "metadata.json", perFrameIntrinsicCoeffs=[])  # older versions have one camera for all
    found = read_capture(recording)
    assert len(found.frames) == 4 and found.frames[0].camera.fy == 6.5


def test_of_a_long_recording_some_are_taken(recording):
    for i in range(700):
        (recording / f"rgbd/{i}.jpg").write_bytes(JPEG)
    told = json.loads((recording / "metadata").read_text())
    change(recording / "metadata", poses=told["poses"] * 175, perFrameIntrinsicCoeffs=None)
    found = read_capture(recording)
    numbers = [int(frame.name) for frame in found.frames]
    assert len(numbers) == 300 and (numbers[0], numbers[-1]) == (0, 699) and max(np.diff(numbers)) == 3
    assert any("300 of 700 frames were taken" in one for one in found.warnings)


def test_frames_count_as_numbers(recording):
    for i in (10, 11):
        (recording / f"rgbd/{i}.jpg").write_bytes(JPEG)
    told = json.loads((recording / "metadata").read_text())
    change(recording / "metadata", poses=told["poses"] * 3, perFrameIntrinsicCoeffs=None)
    assert [frame.name for frame in read_capture(recording).frames][-2:] == ["000010", "000011"]


@pytest.mark.parametrize(
    "values, words",
    [
        ({"poses": []}, "no poses"), ({"poses": None}, "no poses"), ({"poses": [[0] * 7] * 4}, "quaternion"),
        ({"poses": [[0, 0, 0, 1]] * 4}, "quaternion"), ({"w": 0}, "camera of frame"),
        ({"K": 3, "perFrameIntrinsicCoeffs": 1}, "camera of frame"),
    ],
)  # fmt: skip
def test_metadata_that_is_wrong(recording, values, words):
    change(recording / "metadata", **values)
    with pytest.raises(BadInputError, match=words):
        read_capture(recording)


def test_a_recording_that_is_still_zipped(tmp_path):
    (tmp_path / "room.r3d").write_bytes(b"PK\3\4")
    with pytest.raises(BadInputError, match=r"room\.r3d' is a zip; unzip it"):
        read_capture(tmp_path)
