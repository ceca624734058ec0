"""Pictures of 8 and 16 bits in other primaries than Rec.709, told by their ICC profile."""

import struct
from dataclasses import replace

import numpy as np
import pytest

from addon.core.io.oiio import _library, read_coded
from addon.core.io.pictures import read_picture
from addon.core.io.pixels import as_codes, read_pixels
from addon.core.io.primaries import profile_to_rec709
from addon.core.scene.model import AUTO, Camera, Frame

SRGB = [(0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410)]
P3 = [(0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407)]
"""X, Y, Z of red, green and blue as Apple's profiles hold them."""


def _profile(columns):
    """A profile that holds nothing but its primaries."""
    tags, data = [], b""
    at = 128 + 4 + 12 * len(columns)
    for name, xyz in zip((b"rXYZ", b"gXYZ", b"bXYZ"), columns, strict=False):
        tags.append(struct.pack(">4sII", name, at + len(data), 20))
        data += struct.pack(">4s4x3i", b"XYZ ", *(round(65536 * one) for one in xyz))
    content = struct.pack(">I", len(columns)) + b"".join(tags) + data
    header = struct.pack(">I4xI4s4s4s", 128 + len(content), 0x02100000, b"mntr", b"RGB ", b"XYZ ").ljust(36, b"\0")
    header = (header + b"acsp").ljust(68, b"\0") + struct.pack(">3i", 63190, 65536, 54061)
    return header.ljust(128, b"\0") + content


def _write(path, codes, profile):
    library = _library(path)
    spec = library.ImageSpec(codes.shape[1], codes.shape[0], 3, "uint8")
    if profile:
        spec.attribute("ICCProfile", library.TypeDesc(f"uint8[{len(profile)}]"), np.frombuffer(profile, np.uint8))
    out = library.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(codes) and out.close()


def _frame(path, transfer):
    camera = Camera(width=8, height=8, fx=8.0, fy=8.0, cx=4.0, cy=4.0, camera_to_world=np.eye(4))
    return Frame(path.name, path, camera, transfer=transfer, saturation=2.0)


@pytest.mark.parametrize("kind", ["png", "tiff", "jpg"])
@pytest.mark.parametrize("transfer", ["linear", "srgb", AUTO])
def test_display_p3_is_read_as_rec709(tmp_path, kind, transfer):
    """A grey stays what it is; P3's own green is more than Rec.709 holds, and paint of it is more saturated."""
    path = tmp_path / f"a.{kind}"
    codes = np.full((8, 8, 3), 128, np.uint8)
    codes[:, 4:] = (100, 180, 90)
    _write(path, codes, _profile(P3))
    got = read_pixels(_frame(path, transfer)).radiance
    _write(path, codes, b"")
    plain = read_pixels(_frame(path, transfer)).radiance
    np.testing.assert_allclose(got[0, 0], plain[0, 0], rtol=2e-3)
    # SMPTE EG 432-1 and Rec.709 by way of D65: the published matrix.
    want = plain[0, 7] @ np.array([[1.2249, -0.0420, -0.0196], [-0.2247, 1.0419, -0.0786], [0.0, 0.0, 1.0979]])
    np.testing.assert_allclose(got[0, 7], want, atol=3e-3)


def test_what_is_clipped_is_told_by_the_file_s_own_channels(tmp_path):
    codes = np.full((8, 8, 3), (255, 100, 100), np.uint8)
    _write(tmp_path / "a.png", codes, _profile(P3))
    frame = replace(_frame(tmp_path / "a.png", "linear"), saturation=253.5 / 255)
    assert read_pixels(frame).saturated.all()


def test_codes_are_handed_over_in_their_own_primaries(tmp_path):
    """The camera's response is estimated from them, channel by channel."""
    codes = np.full((8, 8, 3), (30, 200, 90), np.uint8)
    _write(tmp_path / "a.png", codes, _profile(P3))
    got = read_pixels(as_codes(_frame(tmp_path / "a.png", AUTO))).radiance
    np.testing.assert_allclose(got, codes / np.float32(255), atol=1e-6)


def test_heic_tells_them_too(tmp_path):
    heif = pytest.importorskip("pillow_heif")
    codes = np.full((64, 64, 3), (100, 180, 90), np.uint8)
    stored = heif.from_bytes(mode="RGB", size=(64, 64), data=codes.tobytes())
    stored.save(tmp_path / "a.heic", quality=-1, chroma=444, icc_profile=_profile(P3))
    assert read_picture(tmp_path / "a.heic", "linear").to_rec709[0, 0] == pytest.approx(1.2249, abs=1e-3)


def test_srgb_s_own_profile_changes_no_number(tmp_path):
    codes = np.random.default_rng(0).integers(0, 256, (8, 8, 3)).astype(np.uint8)
    _write(tmp_path / "a.png", codes, _profile(SRGB))
    assert read_coded(tmp_path / "a.png").profile
    got = read_pixels(_frame(tmp_path / "a.png", "linear")).radiance
    np.testing.assert_allclose(got, codes / np.float32(255), atol=1e-6)


@pytest.mark.parametrize(
    "profile",
    [b"", b"x", bytes(127), bytes(200), _profile(P3)[:-10], _profile(P3[:2]), _profile([(1e4, 0, 0)] * 3),
     bytes(128) + b"\xff" * 400],
)  # fmt: skip
def test_a_profile_that_tells_no_primaries_is_none(profile):
    """Grey ones, tables for printers, and damaged ones: the picture is read as if it had none."""
    assert profile_to_rec709(profile) is None
