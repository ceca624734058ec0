"""PNG masks and previews, against the standard worded byte by byte."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest

from addon.core.capture.png import MAGIC, png_bits, png_size, read_png, write_png
from addon.core.errors import BadInputError

PICTURE = np.random.default_rng(0).integers(0, 256, (7, 9, 3), np.uint8)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(lines: bytes, width, height, bits, colour, extra=b"", interlaced=0) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, interlaced)
    packed = zlib.compress(lines)  # in two chunks, as large files have it
    return (MAGIC + chunk(b"IHDR", header) + extra + chunk(b"IDAT", packed[:5]) + chunk(b"IDAT", packed[5:])
            + chunk(b"IEND", b""))


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


def test_what_is_written_is_read(tmp_path):
    write_png(tmp_path / "a.png", PICTURE)
    np.testing.assert_array_equal(read_png(tmp_path / "a.png"), PICTURE)
    assert png_size(tmp_path / "a.png") == (9, 7)


@pytest.mark.parametrize("kinds", [(0,), (1,), (2,), (3,), (4,), (4, 3, 2, 1, 0)])
@pytest.mark.parametrize("channels, colour", [(1, 0), (2, 4), (3, 2), (4, 6)])
def test_filters(tmp_path, kinds, channels, colour):
    array = np.random.default_rng(1).integers(0, 256, (6, 11, channels), np.uint8)
    (tmp_path / "a.png").write_bytes(png(filtered(array, kinds), 11, 6, 8, colour))
    np.testing.assert_array_equal(read_png(tmp_path / "a.png"), array)


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_few_bits(tmp_path, bits):
    values = np.arange(11) % (1 << bits)
    packed = np.packbits(((values[:, None] >> np.arange(bits)[::-1]) & 1).astype(np.uint8).ravel())
    lines = (b"\0" + packed.tobytes()) * 2
    (tmp_path / "a.png").write_bytes(png(lines, 11, 2, bits, 0))
    np.testing.assert_array_equal(read_png(tmp_path / "a.png")[1, :, 0], values * 255 // ((1 << bits) - 1))
    palette = np.random.default_rng(2).integers(0, 256, (1 << bits, 3), np.uint8)
    (tmp_path / "a.png").write_bytes(png(lines, 11, 2, bits, 3, chunk(b"PLTE", palette.tobytes())))
    np.testing.assert_array_equal(read_png(tmp_path / "a.png")[1], palette[values])
    (tmp_path / "a.png").write_bytes(png(lines, 11, 2, bits, 3, chunk(b"PLTE", palette[:1].tobytes())))
    with pytest.raises(BadInputError, match="palette"):
        read_png(tmp_path / "a.png")


def test_sixteen_bits(tmp_path):
    values = np.random.default_rng(3).integers(0, 1 << 16, (5, 4, 3), np.uint16)
    stored = values.astype(">u2").view(np.uint8).reshape(5, 4, 6)
    (tmp_path / "a.png").write_bytes(png(filtered(stored, (4, 3, 1)), 4, 5, 16, 2))
    np.testing.assert_array_equal(read_png(tmp_path / "a.png"), values)
    write_png(tmp_path / "b.png", values)
    np.testing.assert_array_equal(read_png(tmp_path / "b.png"), values)
    assert png_bits(tmp_path / "a.png") == 16


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (8, 8), (13, 21)])
@pytest.mark.parametrize("bits", [1, 8])
def test_interlaced(tmp_path, size, bits):
    width, height = size
    values = np.random.default_rng(4).integers(0, 1 << bits, (height, width), np.uint8)
    lines = b""
    for y, x, down, right in ((0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2),
                              (1, 0, 2, 1)):
        part = values[y::down, x::right]
        if part.size:
            part = np.packbits(part, axis=1) if bits == 1 else part
            lines += filtered(part[..., None], (4, 2))
    (tmp_path / "a.png").write_bytes(png(lines, width, height, bits, 0, interlaced=1))
    np.testing.assert_array_equal(read_png(tmp_path / "a.png")[..., 0], values * (255 if bits == 1 else 1))


@pytest.mark.parametrize("content, words", [
    (b"", "not a PNG"),
    (b"\xff\xd8\xff\xe0 jpeg", "not a PNG"),
    (png(bytes(20), 4, 4, 8, 0)[:-30], "damaged"),
    (png(bytes(3), 4, 4, 8, 0), "damaged"),
    (png(b"\x09" + bytes(19), 4, 4, 8, 0), "damaged"),
    (png(bytes(20), 4, 4, 8, 0, interlaced=2), "damaged"),
    (png(bytes(20), 4, 4, 3, 0), "damaged"),
    (png(bytes(20), 5000, 5000, 8, 0), "more than it can hold"),
    (png(bytes(20), 2**31, 2**31, 8, 0), "claims"),
    (png(bytes(20), 4, 4, 8, 5), "damaged"),
    (png(bytes(20), 0, 4, 8, 0), "claims"),
])  # fmt: skip
def test_what_is_no_png(tmp_path, content, words):
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(BadInputError, match=f"a.png.*{words}"):
        read_png(tmp_path / "a.png")


def test_a_bomb_is_not_unpacked(tmp_path):
    (tmp_path / "a.png").write_bytes(png(bytes(50_000_000), 4, 4, 8, 0))
    assert read_png(tmp_path / "a.png").shape == (4, 4, 1)


@pytest.mark.parametrize("array", [np.zeros((4, 4, 3)), np.zeros((4, 4), np.uint8), np.zeros((4, 4, 4), np.uint8)])
def test_a_wrong_shape_is_the_callers_mistake(tmp_path, array):
    with pytest.raises(ValueError, match="write_png"):
        write_png(tmp_path / "a.png", array)
