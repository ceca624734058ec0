"""Radiance pictures, written here as the format's own source words it."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.radiance_hdr import hdr_size, read_hdr

RNG = np.random.default_rng(0)
RADIANCE = np.exp(RNG.normal(0, 3, (9, 12, 3)))
RADIANCE[2, 3] = 0
RADIANCE[4:, 6:] = 0.25  # runs


def rgbe(rgb: np.ndarray) -> np.ndarray:
    """color.c, setcolr: the greatest channel's exponent for all, mantissas cut off."""
    greatest = rgb.max(-1)
    fraction, exponent = np.frexp(greatest)
    scale = np.where(greatest > 1e-32, fraction * 256 / np.where(greatest > 0, greatest, 1), 0)
    out = np.concatenate([rgb * scale[..., None], (exponent + 128)[..., None]], -1).astype(np.uint8)
    out[greatest <= 1e-32] = 0
    return out


def flat(lines: np.ndarray) -> bytes:
    return lines.tobytes()


def old_runs(lines: np.ndarray) -> bytes:
    out, pixels = b"", [bytes(pixel) for line in lines for pixel in line]
    width = lines.shape[1]
    for start in range(0, len(pixels), width):
        at = start
        while at < start + width:
            end = at + 1
            while end < start + width and pixels[end] == pixels[at]:
                end += 1
            out += pixels[at]
            if end - at > 1:
                out += bytes((1, 1, 1, end - at - 1))
            at = end
    return out


def new_runs(lines: np.ndarray) -> bytes:
    out = b""
    for line in lines:
        out += bytes((2, 2, len(line) >> 8, len(line) & 255))
        for channel in line.T:
            at = 0
            while at < len(channel):
                end = at + 1
                while end < len(channel) and channel[end] == channel[at] and end - at < 127:
                    end += 1
                if end - at > 2:
                    out += bytes((128 + end - at, channel[at]))
                else:
                    end = at + 1
                    out += bytes((1, channel[at]))
                at = end
    return out


def hdr(body: bytes, height=9, width=12, lines="", form="32-bit_rle_rgbe", size=None) -> bytes:
    size = size or f"-Y {height} +X {width}"
    return f"#?RADIANCE\n# made here\nrpict -vf a.vf\n{lines}FORMAT={form}\n\n{size}\n".encode() + body


def write(tmp_path, content: bytes):
    path = tmp_path / "a.hdr"
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("coding", [flat, old_runs, new_runs])
def test_codings(tmp_path, coding):
    path = write(tmp_path, hdr(coding(rgbe(RADIANCE))))
    got = read_hdr(path).rgb
    assert hdr_size(path) == (12, 9) and got.dtype == np.float32
    # A mantissa has 8 bits of the greatest channel.
    assert (abs(got - RADIANCE) <= RADIANCE.max(-1, keepdims=True) / 256 + 1e-12).all()
    assert not got[2, 3].any()


def test_another_reader_agrees(tmp_path):
    bpy = pytest.importorskip("bpy")
    path = write(tmp_path, hdr(new_runs(rgbe(RADIANCE))))
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(9 * 12 * image.channels, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    theirs = values.reshape(9, 12, -1)[::-1, :, :3]
    # Theirs leaves out Radiance's half of the last bit, which makes the cut mantissas right in the mean.
    half = np.ldexp(0.5, rgbe(RADIANCE)[..., 3:].astype(int) - 136) * (theirs.max(-1, keepdims=True) > 0)
    np.testing.assert_allclose(read_hdr(path).rgb, theirs + half, rtol=1e-6)


@pytest.mark.parametrize("order", ["-Y +X", "-Y -X", "+Y -X", "+Y +X", "+X -Y", "-X -Y", "-X +Y", "+X +Y"])
def test_orders(tmp_path, order):
    first, second = order.split()
    lines = rgbe(RADIANCE)
    # filefmts.pdf: the first axis runs from line to line, and the sign tells in which direction.
    lines = lines if "-Y" in order else lines[::-1]
    lines = lines if "+X" in order else lines[:, ::-1]
    lines = lines if "Y" in first else lines.swapaxes(0, 1)
    count = {"Y": 9, "X": 12}
    size = f"{first} {count[first[1]]} {second} {count[second[1]]}"
    path = write(tmp_path, hdr(new_runs(np.ascontiguousarray(lines)), size=size))
    assert hdr_size(path) == (12, 9)
    np.testing.assert_array_equal(read_hdr(path).rgb, read_hdr(write(tmp_path, hdr(flat(rgbe(RADIANCE))))).rgb)


def test_exposures_and_corrections_are_divided_out(tmp_path):
    plain = read_hdr(write(tmp_path, hdr(flat(rgbe(RADIANCE))))).rgb
    lines = "EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 2 0.5\n"
    got = read_hdr(write(tmp_path, hdr(flat(rgbe(RADIANCE)), lines=lines))).rgb
    np.testing.assert_allclose(got, plain / [8, 16, 4], rtol=1e-6)


def test_xyz_and_primaries(tmp_path):
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])  # IEC 61966-2-1
    path = write(tmp_path, hdr(flat(rgbe(RADIANCE @ to_xyz.T * 179)), form="32-bit_rle_xyze"))
    error = abs(read_hdr(path).rgb - RADIANCE) / (RADIANCE.max(-1, keepdims=True) + 1e-9)
    assert error.max() < 0.06 and np.median(error) < 0.01
    white = np.ones((9, 12, 3))
    lines = "PRIMARIES=0.64 0.33 0.29 0.6 0.15 0.06 0.3333 0.3333\n"
    np.testing.assert_allclose(read_hdr(write(tmp_path, hdr(flat(rgbe(white)), lines=lines))).rgb, 1, rtol=0.01)


@pytest.mark.parametrize("content", [
    b"", b"#?RADIANCE", hdr(b""), hdr(flat(rgbe(RADIANCE))[:-1]), hdr(new_runs(rgbe(RADIANCE))[:-1]),
    hdr(old_runs(rgbe(RADIANCE))[:-5]), hdr(b"", size="-Y 9 +Y 12"), hdr(b"", size="-Y 0 +X 12"), hdr(b"", size="-Y 9"),
    hdr(b"", size="-Y 99999 +X 99999"), hdr(b"\2\2\x4e\x20", size="-Y 6000 +X 20000"),
    hdr(b"\1\1\1\xff" * 9, 4000, 4000),
    hdr(b"", form="float"), hdr(bytes(432), lines="EXPOSURE=0\n"), hdr(bytes(432), lines="EXPOSURE=nan\n"),
    hdr(bytes(432), lines="EXPOSURE=bright\n"), hdr(bytes(432), lines="COLORCORR=1 2\n"),
    hdr(bytes(432), lines="PRIMARIES=0 0 0 0 0 0 0 0\n"), hdr(b"\2\2\0\x0c" + b"\0" * 400),
])  # fmt: skip
def test_damage(tmp_path, content):
    with pytest.raises(BadInputError, match=r"a\.hdr'.*\.$"):
        read_hdr(write(tmp_path, content))
