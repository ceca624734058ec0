"""PNG, against the standard worded byte by byte; JPEG and TIFF, against what others write and what was put in."""

from __future__ import annotations

import os
import struct
import sys
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exif import EXPOSURE_TIME, ISO, exif_exposure
from addon.core.io.layout import Reading
from addon.core.io.oiio import coded_header, read_coded
from addon.core.io.pictures import read_picture
from addon.core.io.pixels import read_pixels
from addon.core.io.png import SIGNATURE, write_png
from addon.core.io.read import read_capture
from tests.core.io.conftest import HEIGHT, JPEG, WIDTH
from tests.core.io.hostile.cases import ADAM7, png_content, tiff_content
from tests.core.io.hostile.cases import CODES as FRAME_CODES

CODES = np.random.default_rng(0).integers(0, 200, (HEIGHT, WIDTH, 3), np.uint8)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(lines: bytes, width, height, bits, colour, extra=b"", interlaced=0) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, interlaced)
    packed = zlib.compress(lines)  # in two chunks, as large files have it
    return (
        SIGNATURE
        + chunk(b"IHDR", header)
        + extra
        + chunk(b"IDAT", packed[:5])
        + chunk(b"IDAT", packed[5:])
        + chunk(b"IEND", b"")
    )


def filtered(array: np.ndarray, kinds) -> bytes:
    """Filter as the PNG standard words it, byte by byte."""
    height, stride = array.shape[0], array[0].size
    step = array.shape[2]
    raw = array.reshape(height, stride).astype(int)
    out = b""
    for y in range(height):
        kind = kinds[y % len(kinds)]
        row = [kind]
        for x in range(stride):
            a = raw[y, x - step] if x >= step else 0
            b = raw[y - 1, x] if y else 0
            c = raw[y - 1, x - step] if y and x >= step else 0
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            row.append((raw[y, x] - [0, a, b, (a + b) // 2, paeth][kind]) % 256)
        out += bytes(int(value) for value in row)
    return out


@pytest.mark.parametrize("kinds", [(0,), (1,), (2,), (3,), (4,), (4, 3, 2, 1, 0)])
@pytest.mark.parametrize("channels, colour", [(1, 0), (2, 4), (3, 2), (4, 6)])
def test_filters(tmp_path, kinds, channels, colour):
    array = np.random.default_rng(1).integers(0, 256, (6, 11, channels), np.uint8)
    (tmp_path / "a.png").write_bytes(png(filtered(array, kinds), 11, 6, 8, colour))
    colour, alpha, *_ = read_coded(tmp_path / "a.png")
    np.testing.assert_array_equal(colour, array[..., : channels - 1 + channels % 2])
    assert (alpha is None) == (channels % 2 == 1)
    if alpha is not None:
        np.testing.assert_array_equal(alpha, array[..., -1])  # and colours are not multiplied by it


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_few_bits(tmp_path, bits):
    values = np.arange(11) % (1 << bits)
    packed = np.packbits(((values[:, None] >> np.arange(bits)[::-1]) & 1).astype(np.uint8).ravel())
    lines = (b"\0" + packed.tobytes()) * 2
    (tmp_path / "a.png").write_bytes(png(lines, 11, 2, bits, 0))
    np.testing.assert_array_equal(read_coded(tmp_path / "a.png").colour[1, :, 0], values * 255 // ((1 << bits) - 1))
    palette = np.random.default_rng(2).integers(0, 256, (1 << bits, 3), np.uint8)
    (tmp_path / "a.png").write_bytes(png(lines, 11, 2, bits, 3, chunk(b"PLTE", palette.tobytes())))
    np.testing.assert_array_equal(read_coded(tmp_path / "a.png").colour[1], palette[values])
    (tmp_path / "a.png").write_bytes(png(lines, 11, 2, bits, 3, chunk(b"PLTE", palette[:1].tobytes())))
    with pytest.raises(BadInputError, match="palette"):
        read_coded(tmp_path / "a.png")


def test_sixteen_bits(tmp_path):
    values = np.random.default_rng(3).integers(0, 1 << 16, (5, 4, 3), np.uint16)
    stored = values.astype(">u2").view(np.uint8).reshape(5, 4, 6)
    (tmp_path / "a.png").write_bytes(png(filtered(stored, (4, 3, 1)), 4, 5, 16, 2))
    np.testing.assert_array_equal(read_coded(tmp_path / "a.png").colour, values)
    assert coded_header(tmp_path / "a.png") == (4, 5, 16)


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (8, 8), (13, 21)])
@pytest.mark.parametrize("bits", [1, 8])
def test_interlaced(tmp_path, size, bits):
    width, height = size
    values = np.random.default_rng(4).integers(0, 1 << bits, (height, width), np.uint8)
    lines = b""
    for y, x, down, right in ADAM7:
        part = values[y::down, x::right]
        if part.size:
            part = np.packbits(part, axis=1) if bits == 1 else part
            lines += filtered(part[..., None], (4, 2))
    (tmp_path / "a.png").write_bytes(png(lines, width, height, bits, 0, interlaced=1))
    np.testing.assert_array_equal(read_coded(tmp_path / "a.png").colour[..., 0], values * (255 if bits == 1 else 1))


@pytest.mark.parametrize("extra", [(b"gAMA", struct.pack(">I", 100_000)), (b"sRGB", b"\0"), (b"sBIT", b"\5\5\5")])
def test_what_a_file_says_of_colours_is_not_heeded(tmp_path, extra):
    array = np.random.default_rng(1).integers(0, 256, (6, 11, 3), np.uint8)
    (tmp_path / "a.png").write_bytes(png(filtered(array, (4,)), 11, 6, 8, 2, chunk(*extra)))
    np.testing.assert_array_equal(read_coded(tmp_path / "a.png").colour, array)


def test_a_transparent_colour_is_alpha(tmp_path):
    array = np.random.default_rng(1).integers(0, 256, (6, 11, 3), np.uint8)
    seen = chunk(b"tRNS", struct.pack(">HHH", *map(int, array[2, 3])))
    (tmp_path / "a.png").write_bytes(png(filtered(array, (0,)), 11, 6, 8, 2, seen))
    colour, alpha, *_ = read_coded(tmp_path / "a.png")
    np.testing.assert_array_equal(colour, array)
    np.testing.assert_array_equal(alpha == 0, (array == array[2, 3]).all(-1))


def test_a_palette_is_found_behind_whatever_else(tmp_path):
    palette = bytes(range(1, 7))
    decoy = chunk(b"tEXt", b"Comment\0\xff\xff\xff\xffPLTE")
    (tmp_path / "a.png").write_bytes(png(b"\0\x50", 2, 1, 1, 3, decoy + chunk(b"PLTE", palette)))
    assert read_coded(tmp_path / "a.png").colour.ravel().tolist() == [1, 2, 3, 4, 5, 6]


def test_a_blank_mask_is_not_doubted(tmp_path):
    for bits, colour, extra in ((1, 0, b""), (1, 3, chunk(b"PLTE", b"\0\0\0\xff\xff\xff"))):
        (tmp_path / "a.png").write_bytes(png((b"\0" + b"\xff" * 500) * 4000, 4000, 4000, bits, colour, extra))
        assert (read_coded(tmp_path / "a.png").colour == 255).all()


@pytest.mark.parametrize("content, words", [
    (b"", "damaged"),
    (b"\xff\xd8\xff\xe0 jpeg", "damaged"),
    (png(bytes(20), 4, 4, 8, 0)[:-30], "damaged"),
    (png(bytes(3), 4, 4, 8, 0), "damaged"),
    (png(b"\x09" + bytes(19), 4, 4, 8, 0), "damaged"),
    (png(bytes(20), 4, 4, 8, 0, interlaced=2), "damaged"),
    (png(bytes(20), 4, 4, 3, 0), "damaged"),
    (png(bytes(20), 5000, 5000, 8, 0), "more than it can hold"),
    (png(bytes(20), 2**31, 2**31, 8, 0), "damaged"),
    (png(bytes(20), 20_000, 20_000, 8, 0), "claims"),
    (png(bytes(20), 4, 4, 8, 5), "damaged"),
    (png(bytes(20), 0, 4, 8, 0), "damaged"),
])  # fmt: skip
def test_what_is_no_png(tmp_path, content, words):
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(BadInputError, match=f"a.png.*{words}"):
        read_coded(tmp_path / "a.png")


def test_a_bomb_is_not_unpacked(tmp_path):
    (tmp_path / "a.png").write_bytes(png(bytes(50_000_000), 4, 4, 8, 0))
    assert read_coded(tmp_path / "a.png").colour.shape == (4, 4, 1)


def jpegs(capture):
    for i in range(10):
        (capture.root / f"images/{i:03d}.jpg").write_bytes(JPEG)
        capture.transforms["frames"][i]["file_path"] = f"images/{i:03d}.jpg"
    capture.save()


@pytest.mark.parametrize("ending, content", [("jpg", JPEG), ("tif", tiff_content()), ("png", png_content())])
def test_cut_off_anywhere(tmp_path, ending, content):
    path = tmp_path / f"a.{ending}"
    path.write_bytes(content)
    assert coded_header(path)[:2] == (8, 6) and read_coded(path).colour.shape[:2] == (6, 8)
    spared = {"png": 12, "tif": 4, "jpg": 0}  # the chunk that ends a PNG holds nothing; no directory follows a TIFF's
    for end in range(len(content) - spared[ending]):
        path.write_bytes(content[:end])
        with pytest.raises(BadInputError, match=f"a.{ending}"):
            read_coded(path)


def test_jpeg_codes(tmp_path):
    (tmp_path / "a.jpg").write_bytes(JPEG)
    np.testing.assert_allclose(read_coded(tmp_path / "a.jpg").colour.ravel(), np.arange(48), atol=12)


def test_tiff_codes(tmp_path):
    (tmp_path / "a.tif").write_bytes(tiff_content())
    np.testing.assert_array_equal(read_coded(tmp_path / "a.tif").colour, FRAME_CODES)


def test_a_name_of_another_kind_and_in_no_language(tmp_path):
    for name in (b"a.tif", b"a", b"a?b=1 #%04d.exr", b"\xff\xfe.png"):
        path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/" + name))
        try:
            path.write_bytes(JPEG)
        except OSError:
            continue  # systems whose names are UTF-8
        if name.startswith(b"\xff") and pytest.importorskip("OpenImageIO").VERSION >= 30200:
            with pytest.raises(BadInputError, match="is not UTF-8.*rename it"):  # it takes text alone
                coded_header(path)
        else:
            assert coded_header(path) == (8, 6, 8)


def test_many_threads(tmp_path):
    pictures = np.random.default_rng(6).integers(0, 1 << 16, (8, 40, 50, 3), np.uint16)
    for i, picture in enumerate(pictures):
        write_png(tmp_path / f"{i}.png", picture)
    with ThreadPoolExecutor(8) as pool:
        for i, got in enumerate(pool.map(lambda i: read_coded(tmp_path / f"{i % 8}.png").colour, range(64))):
            np.testing.assert_array_equal(got, pictures[i % 8])


def test_sizes_as_others_write_them(tmp_path):
    pillow = pytest.importorskip("PIL.Image")
    picture = pillow.fromarray(CODES)
    exif = pillow.Exif()
    exif.get_ifd(0x8769)[EXPOSURE_TIME] = 1 / 80
    exif.get_ifd(0x8769)[ISO] = 320
    for name, options in {"a.jpg": {"progressive": True, "exif": exif}, "b.jpg": {}, "a.tif": {}}.items():
        picture.save(tmp_path / name, **options)
        assert coded_header(tmp_path / name) == (WIDTH, HEIGHT, 8), name
    np.testing.assert_array_equal(read_coded(tmp_path / "a.tif").colour, CODES)
    told = exif_exposure(tmp_path / "a.jpg")
    assert told[EXPOSURE_TIME] == pytest.approx(1 / 80) and told[ISO] == 320
    assert exif_exposure(tmp_path / "b.jpg") == {}
    floats = CODES[..., 0].astype(np.float32) / 7
    pillow.fromarray(floats).save(tmp_path / "f.tif")
    assert coded_header(tmp_path / "f.tif") == (WIDTH, HEIGHT, 0)
    np.testing.assert_array_equal(read_picture(tmp_path / "f.tif").rgb[..., 1], floats)  # no curve
    pillow.fromarray(CODES[..., 0].astype(np.int32)).save(tmp_path / "i.tif")
    with pytest.raises(BadInputError, match="i.tif.*32 bits"):
        coded_header(tmp_path / "i.tif")


def test_frames(capture):
    pillow = pytest.importorskip("PIL.Image")
    jpegs(capture)
    pillow.fromarray(CODES).save(capture.root / "images/003.jpg", quality=95)
    with open(capture.root / "images/003.jpg", "rb") as file:
        codes = np.asarray(pillow.open(file))
    frames = read_capture(capture.root, Reading(transfer="linear")).frames
    np.testing.assert_allclose(read_pixels(frames[3]).radiance, codes / 255, atol=1e-6)
    (capture.root / "images/003.jpg").write_bytes(JPEG[:-20])
    with pytest.raises(BadInputError, match="003.jpg"):
        read_pixels(frames[3])


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


def test_without_the_library(tmp_path, monkeypatch):
    (tmp_path / "a.jpg").write_bytes(JPEG)
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    with pytest.raises(BadInputError, match=r"a\.jpg' needs OpenImageIO.*install it"):
        read_coded(tmp_path / "a.jpg")
