"""Exposure of each frame: camera settings, tables, EXIF."""

from __future__ import annotations

import struct

import pytest

from addon.core.errors import BadInputError
from addon.core.io.exif import EXPOSURE_TIME, F_NUMBER, ISO, exif_exposure, exposure_tags
from addon.core.io.exposures import Settings, parse_number, relative
from addon.core.io.layout import Reading
from addon.core.io.read import describe, read_capture


def exposures(capture, **reading) -> list[float]:
    return [frame.exposure for frame in read_capture(capture.root, Reading(**reading)).frames]


@pytest.mark.parametrize("value, wanted", [("1/60", 1 / 60), ("f/2.8", 2.8), ("0.5 s", 0.5), ("ISO 200", 200),
                                           ([1, 4], 0.25), (3, 3.0), ("1e-3", 1e-3)])  # fmt: skip
def test_numbers_as_cameras_write_them(value, wanted):
    assert parse_number(value, "shutter", "a") == pytest.approx(wanted)


@pytest.mark.parametrize("value", ["auto", "", 0, -1, float("nan"), float("inf"), True, [1, 0], {}, "1/0", "1/2/3"])
def test_what_is_no_number(value):
    with pytest.raises(BadInputError, match="shutter"):
        parse_number(value, "shutter", "a")


def test_relative_exposure_is_time_times_iso_over_f_number_squared():
    settings = [Settings(1 / 100, 4, 100), Settings(1 / 50, 4, 100), Settings(1 / 100, 2, 100), None]
    assert relative(settings) == [pytest.approx(0.5), pytest.approx(1), pytest.approx(2), None]
    assert relative([Settings(1, None, 100), Settings(2, None, None)]) == [1.0, None]
    assert relative([Settings(1e-300, 1e300, 1)]) == [None]


def test_settings_in_the_poses_file(capture):
    for i in range(10):
        capture.frame(i, shutter_speed=f"1/{100 * 2 ** (i % 3)}", aperture="f/2.8", ISO=200)
    result = read_capture(capture.root)
    values = [frame.exposure for frame in result.frames]
    assert values[0] == pytest.approx(2 * values[1]) == pytest.approx(4 * values[2])
    assert sorted(values)[5] == pytest.approx(1)
    assert any("Exposures come from" in warning for warning in result.warnings)
    assert describe(result)["exposures"] == [min(values), max(values)]
    capture.frame(0, exposure=3)  # a stated exposure goes before all settings
    assert exposures(capture)[:2] == [3, 1]


def test_settings_that_say_nothing_cost_no_frame(capture):
    for i in range(10):
        capture.frame(i, shutter="auto")
    result = read_capture(capture.root)
    assert len(result.frames) == 10 and result.warnings == ()


def table(capture, text: str):
    path = capture.root / "exposures.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["{:03d}", "{:03d}.exr", "images/{:03d}.exr", "./images/{:03d}.exr"])
def test_a_table(capture, name):
    text = "\ufeffName,Exposure\n" + "".join(f"{name.format(i)},{i + 1}\n" for i in range(10))
    assert exposures(capture, exposures=table(capture, text)) == [i + 1 for i in range(10)]


def test_a_table_of_settings(capture):
    text = "file,shutter,iso\n" + "".join(f"{i:03d},1/{2 ** (i % 2) * 50},100\n" for i in range(10))
    values = exposures(capture, exposures=table(capture, text))
    assert values[0] == pytest.approx(2 * values[1])


def test_a_table_without_a_frame_and_with_another(capture):
    text = "name,exposure\nabsent,1\n" + "".join(f"{i:03d},2\n" for i in range(9))
    result = read_capture(capture.root, Reading(exposures=table(capture, text)))
    assert len(result.frames) == 9
    assert any("Frame '009' has no line" in warning for warning in result.warnings)
    assert any("such as 'absent'" in warning for warning in result.warnings)


@pytest.mark.parametrize("text, words", [
    ("", "first line"), ("a,b\n", "first line"), ("name\n001\n", "first line"),
    ("name,exposure\n001\n", "1 instead of 2"),
    ("name,exposure\n001,1\n001,2\n", "twice"), ("name,exposure\n001,1\n001.exr,2\n", "twice"),
    ("name,exposure\n001,0\n", "above 0"), ("name,exposure\n001,1e-300\n002,1e300\n", "factors"),
    ("name,exposure\n001,1\n", "too many"), ("name,exposure\n" + "x" * 200_000 + ",1\n", "can't be read"),
])  # fmt: skip
def test_bad_tables(capture, text, words):
    with pytest.raises(BadInputError, match=words):
        read_capture(capture.root, Reading(exposures=table(capture, text)))
    with pytest.raises(BadInputError, match="not there"):
        read_capture(capture.root, Reading(exposures=capture.root / "absent.csv"))


def tiff(order: str, time, f_number, iso, before: int = 0) -> bytes:
    """A TIFF whose first directory points to EXIF's, with so many bytes of pixels before both."""
    head = {"<": b"II*\0", ">": b"MM\0*"}[order] + struct.pack(order + "I", 8 + before) + bytes(before)
    first = struct.pack(order + "HHHIII", 1, 0x8769, 4, 1, 26 + before, 0)
    exif = struct.pack(order + "H", 3) + struct.pack(order + "HHII", EXPOSURE_TIME, 5, 1, 68 + before)
    exif += struct.pack(order + "HHII", F_NUMBER, 5, 1, 76 + before) + struct.pack(order + "HHIHH", ISO, 3, 1, iso, 0)
    return head + first + exif + struct.pack(order + "I4I", 0, *time, *f_number)


@pytest.mark.parametrize("order", "<>")
def test_exif(order):
    data = tiff(order, (1, 250), (28, 10), 400)
    assert exposure_tags(data) == {EXPOSURE_TIME: 1 / 250, F_NUMBER: 2.8, ISO: 400}
    for end in range(len(data)):
        exposure_tags(data[:end])  # whatever is cut off


@pytest.mark.parametrize("before", [0, 600_000, 1_048_530, 3_000_000])
def test_exif_behind_the_pixels(tmp_path, before):
    data = tiff("<", (1, 250), (28, 10), 400, before)
    (tmp_path / "a.tif").write_bytes(data)
    assert exif_exposure(tmp_path / "a.tif") == {EXPOSURE_TIME: 1 / 250, F_NUMBER: 2.8, ISO: 400}
    for end in (4, 7, 9, len(data) - 70):
        (tmp_path / "a.tif").write_bytes(data[:end])
        assert exif_exposure(tmp_path / "a.tif") == {}
