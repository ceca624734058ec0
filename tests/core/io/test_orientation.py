"""How a camera was held: pictures with EXIF by another's encoder, poses of what is stored or of what is shown."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.layout import Reading
from addon.core.io.pixels import read_pixels
from addon.core.io.png import write_png
from addon.core.io.read import read_capture
from addon.core.results.room_file import read_capture_file, write_room
from tests.core.io.conftest import HEIGHT, WIDTH

Image = pytest.importorskip("PIL.Image")
ImageOps = pytest.importorskip("PIL.ImageOps")
LINEAR = Reading(transfer="linear")
ORIENTATION = 0x112
STANDING = [[1, 0, 0, 2], [0, 0, -1, 2], [0, 1, 0, 1], [0, 0, 0, 1]]
"""A camera that is held upright and looks along +Y."""
LYING = [[0, 1, 0, 2], [0, 0, -1, 2], [-1, 0, 0, 1], [0, 0, 0, 1]]
"""The same, turned so that its left is up."""
UPSIDE_DOWN = [[-1, 0, 0, 2], [0, 0, -1, 2], [0, -1, 0, 1], [0, 0, 0, 1]]


def codes(width=WIDTH, height=HEIGHT):
    return np.random.default_rng(0).integers(0, 200, (height, width, 3), np.uint8)


def held(capture, orientations, ending="png", size=(WIDTH, HEIGHT), pose=None, **top):
    """Frames whose EXIF says how they were held."""
    for i, orientation in enumerate(orientations):
        exif = Image.Exif()
        exif[ORIENTATION] = orientation
        told = {"tiffinfo": exif} if ending == "tif" else {"exif": exif}
        Image.fromarray(codes(*size)).save(capture.root / f"images/{i:03d}.{ending}", **told)
        capture.frame(i, file_path=f"images/{i:03d}.{ending}", **({} if pose is None else {"transform_matrix": pose}))
    del capture.transforms["frames"][len(orientations) :]
    capture.top(**top)


def shown(path):
    return np.asarray(ImageOps.exif_transpose(Image.open(path)).convert("RGB")) / 255


@pytest.mark.parametrize("ending", ["png", "jpg", "tif"])
def test_the_cameras_size_tells_that_pictures_were_turned(capture, ending):
    held(capture, [5, 6, 7, 8], ending, w=HEIGHT, h=WIDTH)
    found = read_capture(capture.root, LINEAR)
    assert [frame.turned for frame in found.frames] == [True] * 4
    assert any("4 of 4 pictures were turned" in one for one in found.warnings)
    for frame in found.frames:
        np.testing.assert_allclose(read_pixels(frame).radiance, shown(frame.path), atol=2 / 255)


def test_poses_of_what_is_stored_leave_pictures_as_they_are(capture):
    held(capture, [6, 8, 1, 3], pose=STANDING)  # the one upside down goes with the others
    found = read_capture(capture.root, LINEAR)
    assert not any(frame.turned for frame in found.frames) and not any("EXIF" in one for one in found.warnings)
    np.testing.assert_allclose(read_pixels(found.frames[0]).radiance, codes() / 255, atol=1e-6)


def test_one_upside_down_goes_with_those_on_end(capture):
    held(capture, [6, 3, 1], "jpg")
    capture.frame(0, w=HEIGHT, h=WIDTH)
    found = read_capture(capture.root, LINEAR).frames
    assert [frame.turned for frame in found] == [True, True, False]
    np.testing.assert_allclose(read_pixels(found[1]).radiance, shown(found[1].path), atol=2 / 255)


@pytest.mark.parametrize(
    "orientation, size, pose, turned",
    [
        (3, (WIDTH, HEIGHT), STANDING, True),
        (3, (WIDTH, HEIGHT), UPSIDE_DOWN, False),
        (6, (HEIGHT, HEIGHT), STANDING, True),
        (6, (HEIGHT, HEIGHT), LYING, False),
    ],
)
def test_where_sizes_tell_nothing_up_does(capture, orientation, size, pose, turned):
    held(capture, [orientation] * 3, size=size, pose=pose, w=size[0], h=size[1])
    found = read_capture(capture.root, LINEAR)
    assert [frame.turned for frame in found.frames] == [turned] * 3
    assert not any("taken as stored" in one for one in found.warnings)


def test_what_nothing_tells_is_taken_as_stored_and_told(capture):
    held(capture, [3, 1, 3])  # the cameras look straight down
    found = read_capture(capture.root, LINEAR)
    assert not any(frame.turned for frame in found.frames)
    assert any("2 of 3 pictures" in one and "'000'" in one and "as stored" in one for one in found.warnings)


@pytest.mark.parametrize("orientation", [1, 0, 9, 60000])
def test_a_size_that_no_orientation_explains_is_refused(capture, orientation):
    held(capture, [orientation] * 3, "jpg", w=HEIGHT, h=WIDTH)
    with pytest.raises(BadInputError, match="give them one size"):
        read_capture(capture.root, LINEAR)


def test_masks_are_those_of_the_camera_and_a_result_remembers(capture, tmp_path):
    held(capture, [6, 6, 6], w=HEIGHT, h=WIDTH)
    mask = np.full((WIDTH, HEIGHT, 3), 255, np.uint8)
    mask[0] = 0
    write_png(capture.root / "mask.png", mask)
    capture.frame(0, mask_path="mask.png")
    found = read_capture(capture.root, LINEAR)
    assert not read_pixels(found.frames[0]).valid[0].any() and read_pixels(found.frames[0]).valid[1:].all()
    (tmp_path / "result").mkdir()
    write_room(tmp_path / "result", found)
    again, _ = read_capture_file(tmp_path / "result")
    assert [frame.turned for frame in again.frames] == [True] * 3
