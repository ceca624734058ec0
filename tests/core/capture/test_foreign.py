"""JPEG and TIFF: what their headers tell, and the copies that the core reads."""

from __future__ import annotations

import os

import numpy as np
import pytest

from addon.core.capture.copies import converted, reading_through
from addon.core.capture.fingerprint import fingerprint
from addon.core.capture.foreign import exif_exposure, foreign_info
from addon.core.capture.layout import Reading
from addon.core.capture.pixels import read_pixels
from addon.core.capture.read import read_capture
from addon.core.capture.tiff_tags import EXPOSURE_TIME, ISO
from addon.core.errors import BadInputError
from addon.core.progress import Progress
from tests.core.capture.conftest import HEIGHT, JPEG, WIDTH

CODES = np.random.default_rng(0).integers(0, 200, (HEIGHT, WIDTH, 3), np.uint8)


def jpegs(capture):
    for i in range(10):
        (capture.root / f"images/{i:03d}.jpg").write_bytes(JPEG)
        capture.transforms["frames"][i]["file_path"] = f"images/{i:03d}.jpg"
    capture.save()


def test_sizes(tmp_path):
    path = tmp_path / "a.jpg"
    path.write_bytes(JPEG)
    assert foreign_info(path) == (8, 6, 8)
    for end in range(3, len(JPEG) - 5):
        path.write_bytes(JPEG[:end])
        with pytest.raises(BadInputError, match="a.jpg"):
            foreign_info(path)


def test_sizes_as_others_write_them(tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    picture = pillow.fromarray(CODES)
    exif = pillow.Exif()
    exif.get_ifd(0x8769)[EXPOSURE_TIME] = 1 / 80
    exif.get_ifd(0x8769)[ISO] = 320
    for name, options in {"a.jpg": {"progressive": True, "exif": exif}, "b.jpg": {}, "a.tif": {}}.items():
        picture.save(tmp_path / name, **options)
        assert foreign_info(tmp_path / name) == (WIDTH, HEIGHT, 8), name
    told = exif_exposure(tmp_path / "a.jpg")
    assert told[EXPOSURE_TIME] == pytest.approx(1 / 80) and told[ISO] == 320
    assert exif_exposure(tmp_path / "b.jpg") == {}
    pillow.fromarray(CODES[..., 0].astype(np.float32)).save(tmp_path / "f.tif")
    assert foreign_info(tmp_path / "f.tif") == (WIDTH, HEIGHT, 0)


def test_frames_are_copied_once(capture, tmp_path):
    jpegs(capture)
    result = read_capture(capture.root, Reading(transfer="linear"))
    with pytest.raises(BadInputError, match="Blender has to decode"):
        read_pixels(result.frames[0])
    asked = []

    def load(path):
        asked.append(path)
        return CODES

    copies = converted(result, tmp_path / "copies", load, Progress())
    assert len(asked) == 10
    np.testing.assert_allclose(read_pixels(copies.frames[3]).radiance, CODES / 255, atol=1e-6)
    np.testing.assert_array_equal(reading_through(load)(result.frames[3]).radiance,
                                  read_pixels(copies.frames[3]).radiance)
    asked.clear()
    again = converted(result, tmp_path / "copies", load, Progress())
    assert not asked and fingerprint(again) == fingerprint(copies)
    before = fingerprint(copies)
    os.utime(capture.root / "images/003.jpg", (1, 1))
    changed = converted(result, tmp_path / "copies", load, Progress())
    assert len(asked) == 1 and len(list((tmp_path / "copies").iterdir())) == 10
    assert fingerprint(changed) != before


def test_exif_gives_exposures(capture):
    pillow = pytest.importorskip("PIL.Image")
    jpegs(capture)
    for i in range(10):
        exif = pillow.Exif()
        exif.get_ifd(0x8769)[EXPOSURE_TIME] = 0.01 * 2 ** (i % 2)
        pillow.fromarray(CODES).save(capture.root / f"images/{i:03d}.jpg", exif=exif)
    result = read_capture(capture.root, Reading(transfer="srgb"))
    values = [frame.exposure for frame in result.frames]
    assert values[1] == pytest.approx(2 * values[0])
    assert any("EXIF" in warning for warning in result.warnings)
