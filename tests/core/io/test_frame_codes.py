"""Frames of 8 and 16 bits: curves, and where codes end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.layout import Reading
from addon.core.io.pictures import picture_bits, read_picture
from addon.core.io.pixels import as_codes, read_pixels
from addon.core.io.png import write_png
from addon.core.io.read import describe, read_capture
from addon.core.io.transfer import decode, to_linear
from addon.core.scene.radiometry import Radiometry
from tests.core.io.conftest import HEIGHT, WIDTH

CODES = (np.arange(HEIGHT * WIDTH * 3) % 256).reshape(HEIGHT, WIDTH, 3).astype(np.uint8)


def as_png(capture, *indices):
    for i in indices:
        (capture.root / f"images/{i:03d}.exr").unlink()
        write_png(capture.root / f"images/{i:03d}.png", CODES)
        capture.transforms["frames"][i]["file_path"] = f"images/{i:03d}.png"
    capture.save()


def test_srgb_is_the_standards_curve():
    # IEC 61966-2-1: the two pieces meet, code 188 is near 0.5, ends are ends.
    codes = np.array([0, 0.04045, 188 / 255, 1])
    np.testing.assert_allclose(to_linear(codes, "srgb"), [0, 0.0031308, 0.5029, 1], atol=1e-4)
    assert decode(np.array([65535], np.uint16), "2.2")[0] == 1
    assert decode(np.array([51], np.uint8), "linear")[0] == np.float32(0.2)


@pytest.mark.parametrize("transfer", ["srgb", "linear", "2.2"])
def test_frames_of_codes(capture, transfer):
    as_png(capture, *range(10))
    result = read_capture(capture.root, Reading(transfer=transfer))
    assert any(f"curve '{transfer}'" in warning and "10 of 10" in warning for warning in result.warnings)
    assert describe(result)["curve_of_codes"] == transfer
    frame = result.frames[0]
    pixels = read_pixels(replace(frame, exposure=2.0))
    np.testing.assert_allclose(pixels.radiance, to_linear(CODES / 255, transfer) / 2, atol=1e-6)
    clipped = (CODES >= 249).any(-1)
    np.testing.assert_array_equal(pixels.saturated, clipped)
    assert pixels.valid.all()


def test_codes_among_floats_are_left_out_with_what_to_do(capture):
    as_png(capture, 4)
    result = read_capture(capture.root)
    assert len(result.frames) == 9 and any("--transfer" in warning for warning in result.warnings)


@pytest.mark.parametrize("told", ["", "auto"])
def test_a_curve_that_nobody_told_is_srgbs_until_it_is_calibrated(capture, told):
    as_png(capture, *range(10))
    result = read_capture(capture.root, Reading(transfer=told))
    assert len(result.frames) == 10 and all(frame.uncalibrated for frame in result.frames)
    assert [warning.count("--transfer") for warning in result.warnings if "10 of 10" in warning] == [1]
    frame = replace(result.frames[0], exposure=2.0)
    pixels = read_pixels(frame)
    np.testing.assert_allclose(pixels.radiance, to_linear(CODES / 255, "srgb") / 2, atol=1e-6)
    np.testing.assert_array_equal(pixels.saturated, (CODES >= 249).any(-1))
    # Calibrated: a linear response, an exposure of each channel that stands for the frame's own, and vignetting.
    camera = frame.camera
    linear = np.tile(np.linspace(0, 1, 256), (3, 1))
    known = replace(frame, radiometry=Radiometry(linear, np.array([1.0, 2.0, 4.0]), np.array([-0.5, 0.0])))
    assert not known.uncalibrated
    column, row = np.arange(WIDTH) + 0.5 - camera.cx, np.arange(HEIGHT)[:, None] + 0.5 - camera.cy
    dark = np.exp(-0.5 * ((column / camera.fx) ** 2 + (row / camera.fy) ** 2))
    expected = CODES / 255 / dark[..., None] / (1, 2, 4)
    np.testing.assert_allclose(read_pixels(known).radiance, expected, rtol=1e-4, atol=1e-6)
    np.testing.assert_array_equal(read_pixels(known).saturated, (CODES >= 249).any(-1))
    np.testing.assert_allclose(read_pixels(as_codes(known)).radiance, CODES / 255, atol=1e-6)


@pytest.mark.parametrize("transfer", ["sRGB!", "0", "-1", "nan", "inf", "1e9"])
def test_curves_that_are_none(capture, transfer):
    with pytest.raises(BadInputError, match="no curve"):
        read_capture(capture.root, Reading(transfer=transfer))


def test_gray_and_alpha(tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    gray = np.stack([CODES[..., 0], np.full((HEIGHT, WIDTH), 128, np.uint8)], -1)
    pillow.fromarray(gray, "LA").save(tmp_path / "a.png")
    rgb, alpha, *_ = read_picture(tmp_path / "a.png", "linear")
    np.testing.assert_allclose(rgb, np.repeat(CODES[..., :1], 3, -1) / 255, atol=1e-6)
    np.testing.assert_allclose(alpha, 128 / 255)
    assert picture_bits(tmp_path / "a.png") == 8
