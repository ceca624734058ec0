"""Clipping is found where it is, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.clipping import find_clipping
from addon.core.io.exr import HALF_MAX
from addon.core.io.pixels import read_pixels
from addon.core.io.read import describe, read_capture
from addon.core.scene.model import Camera, Frame
from tests.core.io.conftest import HEIGHT, WIDTH

SIZE = 32
CAMERA = Camera(SIZE, SIZE, 30, 30, 16, 16, np.eye(4))
EXPOSURES = (0.5, 0.7, 1.0, 1.4, 2.0)


def scene(i: int, lamp=(28, 26, 23), noise: float = 0.0) -> np.ndarray:
    """A wall in soft light with a lamp on it, whose edge is out of focus."""
    y, x = np.mgrid[:SIZE, :SIZE]
    wall = (0.3 + 0.2 * np.sin(x / 9 + i) + 0.1 * np.cos(y / 7))[..., None] * np.array([1, 0.8, 0.6])
    share = np.clip((10.3 + 0.1 * i - np.hypot(x - 16, y - 16)) / 5, 0, 1)[..., None]
    picture = (1 - share) * wall + share * np.array(lamp)
    return picture * (1 + noise * np.random.default_rng(i).normal(size=picture.shape))


def found(pictures, exposures=None, **values):
    """Saturation of each frame, and the notes."""
    exposures = exposures or [1.0] * len(pictures)
    stored = {f"{i}": picture.astype(np.float16).astype(np.float32) for i, picture in enumerate(pictures)}
    frames = [Frame(name, name, CAMERA, exposure=e, **values) for name, e in zip(stored, exposures)]
    frames, notes = find_clipping(frames, stored.__getitem__)
    return np.array([frame.saturation for frame in frames]), notes


@pytest.mark.parametrize("noise", [0, 0.02])
@pytest.mark.parametrize("lamp", [(28, 26, 23), (10, 10, 10), (10, 10, 5)])
def test_clipping_and_lamps_of_one_radiance_are_told_apart(noise, lamp):
    pictures = [scene(i, lamp, noise) for i in range(5)]
    assert found(pictures) == (pytest.approx([np.inf] * 5), [])
    saturation, notes = found([np.minimum(picture, 4) for picture in pictures])
    # What is neither coloured nor noisy clips in all channels at once, and is a lamp for all that anyone can tell.
    if lamp == (28, 26, 23) or noise:
        assert saturation == pytest.approx(4, rel=2e-3) and len(notes) == 1 and "clip at 4" in notes[0]
        assert (saturation < 4).all()


@pytest.mark.parametrize("lamp", [(28, 26, 23), (30, 30, 30)])
def test_exposure_before_the_sensor(lamp):
    pictures = [np.minimum(scene(i, lamp) * e, 4) for i, e in enumerate(EXPOSURES)]
    saturation, _ = found(pictures, EXPOSURES)
    assert saturation == pytest.approx(4, rel=2e-3)
    assert found([scene(i, lamp) * e for i, e in enumerate(EXPOSURES)], EXPOSURES)[1] == []


def test_exposure_after_clipping():
    pictures = [np.minimum(scene(i, noise=0.02), 4) * e for i, e in enumerate(EXPOSURES)]
    saturation, notes = found(pictures, EXPOSURES)
    assert saturation == pytest.approx(4 * np.array(EXPOSURES), rel=2e-3) and "times the exposure" in notes[0]


def test_what_the_capture_states_stays():
    pictures = [np.minimum(scene(i), 4) for i in range(3)]
    assert found(pictures, saturation=9.0) == (pytest.approx([9.0] * 3), [])


@pytest.mark.parametrize("value", [0, 0.5, np.nan, np.inf, HALF_MAX])
def test_pictures_of_one_value(value):
    assert found([np.full((SIZE, SIZE, 3), value)] * 3)[1] == []


def test_no_frames_and_bad_ones():
    def bad(path):
        raise BadInputError("damaged")

    assert find_clipping((), bad) == ((), [])
    frame = Frame("a", "a", CAMERA)
    assert find_clipping([frame], bad) == ((frame,), [])


def test_the_reader_tells(capture):
    rng = np.random.default_rng(0)
    for i in range(10):
        capture.picture(i, np.minimum(rng.lognormal(0, 1, (HEIGHT, WIDTH, 3)), 1.5))
    read = read_capture(capture.root)
    assert "clip at 1.5" in describe(read)["warnings"][0]
    assert all(read_pixels(frame).saturated.any() for frame in read.frames)


def test_an_exposure_that_some_frames_lack(capture):
    for i in range(9):
        capture.frame(i, exposure=0.5)
    read = read_capture(capture.root)
    assert read.warnings[0].startswith("1 of 10 frames state no exposure (the first: '009')")
    assert [frame.exposure for frame in read.frames] == [0.5] * 9 + [1.0]
    capture.top(exposure=2.0)
    assert [frame.exposure for frame in read_capture(capture.root).frames] == [0.5] * 9 + [2.0]


@pytest.mark.parametrize("value", [0, -1, float("nan"), float("inf"), "1", [], True])
@pytest.mark.parametrize("key", ["exposure", "saturation"])
def test_exposures_that_are_none(capture, key, value):
    if key == "saturation" and value == float("inf"):
        return  # says that nothing clips
    capture.top(exposure=1.0)
    capture.frame(3, **{key: value})
    read = read_capture(capture.root)
    assert len(read.frames) == 9 and f"'003' has {key} = " in read.warnings[0]
