"""HEIC and DNG, as phones write them: what was put in, what EXIF tells, and what is wrong."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exif import EXPOSURE_TIME, exif_exposure
from addon.core.io.layout import Reading
from addon.core.io.pictures import picture_bits, picture_kind, picture_orientation, picture_size, read_picture
from addon.core.io.pixels import read_pixels
from addon.core.io.read import read_capture
from addon.core.scene.model import AUTO
from tests.core.io.dng_files import write_dng

SIZE = 64, 48
SMOOTH = np.stack(
    [*np.meshgrid(np.linspace(0.1, 0.7, SIZE[0]), np.linspace(0.2, 0.6, SIZE[1])), np.full(SIZE[::-1], 0.4)], -1
)


def write_heic(path, orientation=1, seconds=0.01, bits=8):
    heif = pytest.importorskip("pillow_heif")
    exif = pytest.importorskip("PIL.Image").Exif()
    exif.get_ifd(0x8769)[EXPOSURE_TIME] = seconds
    exif[0x112] = orientation
    mode, kind = ("RGB", np.uint8) if bits == 8 else ("RGB;16", np.uint16)
    codes = np.rint(SMOOTH * np.iinfo(kind).max).astype(kind)
    heif.from_bytes(mode=mode, size=SIZE, data=codes.tobytes()).save(path, quality=-1, chroma=444, exif=exif.tobytes())


def write_raw(path, orientation=1, seconds=0.01):
    pytest.importorskip("rawpy")
    write_dng(path, SMOOTH, orientation, seconds)


WRITERS = {"heic": write_heic, "dng": write_raw}


@pytest.fixture(params=WRITERS)
def pictures(request, capture):
    """A capture of such frames, each taken twice as long as the one before."""
    for i in range(4):
        WRITERS[request.param](capture.root / f"images/{i:03d}.{request.param}", seconds=0.01 * 2**i)
        capture.frame(i, file_path=f"images/{i:03d}.{request.param}")
    del capture.transforms["frames"][4:]
    capture.top(w=SIZE[0], h=SIZE[1], fl_x=60.0, fl_y=60.0, cx=32.0, cy=24.0)
    return request.param, capture


def test_frames_and_their_exposures(pictures):
    kind, capture = pictures
    found = read_capture(capture.root)
    exposures = [frame.exposure for frame in found.frames]
    np.testing.assert_allclose(np.array(exposures) / exposures[0], [1, 2, 4, 8], rtol=1e-3)
    assert [frame.transfer for frame in found.frames] == [AUTO if kind == "heic" else ""] * 4
    assert read_pixels(found.frames[0]).valid.all()


@pytest.mark.parametrize("bits, off", [(8, 0.012), (10, 0.004)])
def test_heic_codes(tmp_path, bits, off):
    write_heic(tmp_path / "a", bits=bits)  # known by its content
    assert picture_kind(tmp_path / "a") == "HEIC" and picture_size(tmp_path / "a") == SIZE
    assert picture_bits(tmp_path / "a") == (8 if bits == 8 else 16) and picture_orientation(tmp_path / "a") == 1
    np.testing.assert_allclose(read_picture(tmp_path / "a", "linear").rgb, SMOOTH, atol=off)
    assert exif_exposure(tmp_path / "a")[EXPOSURE_TIME] == pytest.approx(0.01)


@pytest.mark.parametrize("orientation", [6, 8])
def test_heic_is_as_shown_or_as_the_sensor_gave_it(capture, orientation):
    """The encoder writes `irot`, and its numbers are the sensor's."""
    for i in range(4):
        write_heic(capture.root / f"images/{i:03d}.heic", orientation)
        capture.frame(i, file_path=f"images/{i:03d}.heic")
    del capture.transforms["frames"][4:]
    as_shown = np.rot90(SMOOTH, -1 if orientation == 6 else 1)
    for (width, height), wanted in ((SIZE[::-1], as_shown), (SIZE, SMOOTH)):
        capture.top(w=width, h=height, fl_x=60.0, fl_y=60.0, cx=width / 2, cy=height / 2)
        frame = read_capture(capture.root, Reading(transfer="linear")).frames[0]
        assert frame.turned == (wanted is SMOOTH)
        np.testing.assert_allclose(read_pixels(frame).radiance, wanted, atol=0.012)


def test_a_white_of_ten_bits_is_the_top(tmp_path):
    heif = pytest.importorskip("pillow_heif")
    white = np.full((*SIZE[::-1], 3), 65535, np.uint16)
    heif.from_bytes(mode="RGB;16", size=SIZE, data=white.tobytes()).save(tmp_path / "a.heic", quality=-1, chroma=444)
    assert read_picture(tmp_path / "a.heic", "linear").rgb.min() == 1


def test_dng_is_linear_light(tmp_path):
    write_raw(tmp_path / "a.tif", orientation=6)  # known by its content
    path = tmp_path / "a.tif"
    assert picture_kind(path) == "DNG" and picture_bits(path) == 0 and picture_orientation(path) == 6
    assert picture_size(path) == SIZE and picture_size(path, turned=True) == SIZE[::-1]
    inner = np.s_[4:-4, 4:-4]  # edges of a mosaic are guesses
    np.testing.assert_allclose(read_picture(path).rgb[inner], SMOOTH[inner], atol=0.006)
    np.testing.assert_allclose(read_picture(path, turned=True).rgb[inner], np.rot90(SMOOTH, -1)[inner], atol=0.006)


def test_a_dng_clips_at_one(tmp_path):
    pytest.importorskip("rawpy")
    write_dng(tmp_path / "a.dng", SMOOTH * 3)
    rgb = read_picture(tmp_path / "a.dng").rgb
    assert rgb.max() == 1 and (rgb[SMOOTH[..., 0] * 3 > 1.1][:, 0] > 0.999).mean() > 0.95


@pytest.mark.parametrize("kind", WRITERS)
def test_cut_off(tmp_path, kind):
    path = tmp_path / f"a.{kind}"
    WRITERS[kind](path)
    content = path.read_bytes()
    for end in range(16, len(content), max(len(content) // 40, 1)):
        path.write_bytes(content[:end])
        with pytest.raises(BadInputError, match=rf"a\.{kind}"):
            read_picture(path, "linear")


@pytest.mark.parametrize("kind, module", [("heic", "pillow_heif"), ("dng", "rawpy")])
def test_without_the_library(tmp_path, monkeypatch, kind, module):
    WRITERS[kind](tmp_path / f"a.{kind}")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(BadInputError, match=rf"a\.{kind}' is .*install it \(pip: {module.replace('_', '-')}\)"):
        picture_size(tmp_path / f"a.{kind}")
