"""OpenEXR: what is read and written, and that nothing damaged gets through or brings the process down."""

from __future__ import annotations

import errno
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from addon.core.errors import BadInputError, StorageError
from addon.core.io import exr_header
from addon.core.io.exr import HALF_MAX, exr_note, read_exr, read_header, write_exr
from addon.core.io.primaries import REC709, to_rgb

ROOT = Path(__file__).resolve().parents[3]
PICTURE = np.random.default_rng(0).random((40, 70, 4), np.float32)


def write_with_library(path, planes, **header):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    OpenEXR.File(header, planes).write(str(path))


@pytest.mark.parametrize("shape", [(40, 70), (40, 70, 3), (40, 70, 4)])
@pytest.mark.parametrize("half", [False, True])
def test_what_is_written_is_read(tmp_path, shape, half):
    array = PICTURE.ravel()[: np.prod(shape)].reshape(shape)
    write_exr(tmp_path / "a.exr", array, half)
    rgb, alpha, *_ = read_exr(tmp_path / "a.exr")
    wanted = np.repeat(array[..., None], 3, -1) if array.ndim == 2 else array
    assert rgb.dtype == np.float32
    np.testing.assert_allclose(rgb, wanted[..., :3], rtol=5e-4 if half else 0, atol=1e-7 if half else 0)
    assert (alpha is None) == (shape[-1] != 4)
    assert read_header(tmp_path / "a.exr") == (70, 40)


def test_a_file_of_more_channels_than_memory_should_hold_is_refused_by_its_header(tmp_path):
    path = tmp_path / "a.exr"
    write_with_library(path, {f"layer{i}.{c}": np.zeros((16, 16), np.float32) for i in range(12) for c in "RGB"})
    small, large = (struct.pack("<4i", 0, 0, size - 1, size - 1) for size in (16, 8192))
    # As long as a well packed file of that size could be.
    path.write_bytes(path.read_bytes().replace(small, large) + bytes(1 << 25))
    with pytest.raises(BadInputError, match="over 2 GiB of pixels in all its channels"):
        read_header(path)


def test_half_holds_large_values_and_keeps_inf_and_nan(tmp_path):
    write_exr(tmp_path / "a.exr", np.array([[1e9, np.inf, np.nan, -1e9]]), half=True)
    np.testing.assert_array_equal(read_exr(tmp_path / "a.exr").rgb[0, :, 0], [HALF_MAX, np.inf, np.nan, -HALF_MAX])


@pytest.mark.parametrize("kind", [np.uint32, np.float16, np.float32])
@pytest.mark.parametrize("storage", [OpenEXR.scanlineimage, OpenEXR.tiledimage])
def test_pixel_types_and_tiles(tmp_path, kind, storage):
    values = (PICTURE[..., :3] * 100).astype(kind)
    header = {"type": storage}
    if storage == OpenEXR.tiledimage:
        header["tiles"] = OpenEXR.TileDescription()
    write_with_library(
        tmp_path / "a.exr", {c: np.ascontiguousarray(values[..., i]) for i, c in enumerate("RGB")}, **header
    )
    np.testing.assert_array_equal(read_exr(tmp_path / "a.exr").rgb, values.astype(np.float32))


@pytest.mark.parametrize(
    "name", ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB", "ZSTD", "HTJ2K256", "HTJ2K32"]
)
def test_every_compression_passes_the_look_at_the_header(tmp_path, name):
    planes = {c: np.ascontiguousarray(PICTURE[..., i].astype(np.float16)) for i, c in enumerate("RGB")}
    compression = getattr(OpenEXR, f"{name}_COMPRESSION", None)
    if compression is None:
        pytest.skip(f"this OpenEXR has no {name}")
    write_with_library(tmp_path / "a.exr", planes, compression=compression)
    assert read_header(tmp_path / "a.exr") == (70, 40)
    assert abs(read_exr(tmp_path / "a.exr").rgb - PICTURE[..., :3]).mean() < 0.05


def test_the_display_window_is_the_picture(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, PICTURE)
    patched(path, b"displayWindow", struct.pack("<4i", 10, -5, 99, 29))  # data is 0...69 x 0...39
    rgb, alpha, *_ = read_exr(path)
    assert rgb.shape == (35, 90, 3) and read_header(path) == (90, 35)
    np.testing.assert_array_equal(rgb[5:, :60], PICTURE[:30, 10:, :3])
    np.testing.assert_array_equal(alpha[5:, :60], PICTURE[:30, 10:, 3])
    assert np.isnan(rgb[:5]).all() and np.isnan(rgb[:, 60:]).all() and not alpha[:5].any() and not alpha[:, 60:].any()


def test_a_display_window_apart_from_the_data(shared):
    rgb = read_exr(shared / "data/exr/DisplayWindow/t10.exr").rgb
    assert rgb.shape == (300, 100, 3) and np.isnan(rgb).all()


def test_other_primaries_become_rec709(shared):
    wanted = read_exr(shared / "data/exr/Chromaticities/Rec709.exr").rgb
    got = read_exr(shared / "data/exr/Chromaticities/XYZ.exr").rgb
    np.testing.assert_allclose(got, wanted, atol=0.01)
    assert abs(got - wanted).mean() < 3e-4


def test_senseless_primaries(tmp_path):
    plane = np.ones((4, 4), np.float32)
    write_with_library(
        tmp_path / "a.exr", dict.fromkeys("RGB", plane), chromaticities=(0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3)
    )
    with pytest.raises(BadInputError, match="primaries"):
        read_exr(tmp_path / "a.exr")


@pytest.mark.parametrize("names", ["G", "Z", ("normal.X", "normal.Y1", "normal.Z")])
def test_channels_without_meaning_are_named(tmp_path, names):
    write_with_library(tmp_path / "a.exr", {name: np.ones((4, 4), np.float32) for name in names})
    for read in (read_exr, read_header):
        with pytest.raises(BadInputError, match=f"a.exr.*{sorted(names)[0]}"):
            read(tmp_path / "a.exr")


def test_luminance_and_chroma(shared):
    # The same picture stored as RGB is the second opinion; chroma is stored at a quarter of the pixels.
    folder = shared / "data/exr/Chromaticities"
    wanted = read_exr(folder / "Rec709.exr").rgb
    for name, mean in (("Rec709_YC", 0.008), ("XYZ_YC", 0.008)):
        error = abs(read_exr(folder / f"{name}.exr").rgb - wanted)
        assert error.mean() < mean and np.percentile(error, 99) < 0.1, name


def test_chroma_of_smooth_colours():
    y, x = np.mgrid[:31, :40] / 40
    rgb = np.stack([1 + x, 1 + 0.5 * y, 1.5 - x * y], -1)
    luma = rgb @ [0.2126, 0.7152, 0.0722]
    ry, by = (((rgb[..., i] - luma) / luma)[::2, ::2].astype(np.float32) for i in (0, 2))
    got = to_rgb(luma.astype(np.float32), ry, by, REC709)
    np.testing.assert_allclose(got[14:-14, 14:-14], rgb[14:-14, 14:-14], atol=1e-3)
    np.testing.assert_allclose(got, rgb, atol=0.05)  # the filter has nothing beyond the picture's edge


def test_channels_in_small_letters_are_the_same(tmp_path):
    planes = {"Y": PICTURE[..., 0], "RY": PICTURE[..., 1], "BY": PICTURE[..., 2]}
    write_with_library(tmp_path / "a.exr", {name: plane.copy() for name, plane in planes.items()})
    write_with_library(tmp_path / "b.exr", {name.lower(): plane.copy() for name, plane in planes.items()})
    np.testing.assert_array_equal(read_exr(tmp_path / "a.exr").rgb, read_exr(tmp_path / "b.exr").rgb)


def planes_of(array, prefix=""):
    return {f"{prefix}{c}": np.ascontiguousarray(array[..., i]) for i, c in enumerate("RGB")}


def test_layers(tmp_path):
    path, other = tmp_path / "a.exr", PICTURE[::-1]
    write_with_library(path, planes_of(PICTURE) | planes_of(other, "diffuse."))
    np.testing.assert_array_equal(read_exr(path).rgb, PICTURE[..., :3])
    assert exr_note(path) == ""
    write_with_library(path, planes_of(PICTURE, "View Layer.Combined.") | planes_of(other, "View Layer.DiffCol."))
    np.testing.assert_array_equal(read_exr(path).rgb, PICTURE[..., :3])
    assert "'View Layer.Combined'" in exr_note(path)
    write_with_library(path, planes_of(PICTURE, "a.") | {"depth.Z": PICTURE[..., 3].copy()})  # only one has colours
    np.testing.assert_array_equal(read_exr(path).rgb, PICTURE[..., :3])
    write_with_library(path, planes_of(PICTURE, "direct.") | planes_of(other, "indirect."))
    for read in (read_exr, read_header):
        with pytest.raises(BadInputError, match="a.exr' holds the layers direct, indirect"):
            read(path)


def test_parts(tmp_path):
    path, other = tmp_path / "a.exr", PICTURE[::-1]
    tiled = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    parts = [OpenEXR.Part({}, planes_of(other), "albedo"), OpenEXR.Part(tiled, planes_of(PICTURE), "Beauty")]
    OpenEXR.File(parts).write(str(path))
    assert read_header(path) == (70, 40)
    np.testing.assert_array_equal(read_exr(path).rgb, PICTURE[..., :3])
    assert "'Beauty'" in exr_note(path)
    OpenEXR.File([OpenEXR.Part({}, planes_of(other), name) for name in ("albedo", "normal")]).write(str(path))
    with pytest.raises(BadInputError, match="layers albedo, normal"):
        read_exr(path)
    content = path.read_bytes()
    path.write_bytes(content[:-200])
    with pytest.raises(BadInputError, match="cut off"):
        read_header(path)


def test_views(tmp_path):
    path = tmp_path / "a.exr"
    parts = [
        OpenEXR.Part({"view": view}, planes_of(PICTURE * (k + 1)), f"rgba.{view}")
        for k, view in enumerate(("left", "right"))
    ]
    OpenEXR.File(parts).write(str(path))
    np.testing.assert_array_equal(read_exr(path).rgb, PICTURE[..., :3])
    assert exr_note(path) == "of the views left, right, 'left'"
    write_with_library(path, planes_of(PICTURE) | planes_of(PICTURE * 2, "right."), multiView=["left", "right"])
    np.testing.assert_array_equal(read_exr(path).rgb, PICTURE[..., :3])
    assert exr_note(path) == "of the views left, right, 'left'"


@pytest.mark.parametrize("mode", [OpenEXR.MIPMAP_LEVELS, OpenEXR.RIPMAP_LEVELS])
def test_levels_of_tiles(tmp_path, mode):
    # By hand, as the library's Python writes the largest level alone.
    path, edge = tmp_path / "a.exr", 16
    tiles = OpenEXR.TileDescription()
    tiles.xSize, tiles.ySize, tiles.mode = edge, edge, mode
    write_with_library(
        path, planes_of(PICTURE), type=OpenEXR.tiledimage, tiles=tiles, compression=OpenEXR.NO_COMPRESSION
    )
    content = path.read_bytes()
    (_, at, (chunks,)) = exr_header._parse(content, len(content))
    sizes = [[max(n >> level, 1) for level in range(7)] for n in (70, 40)]
    levels = (
        [(k, k) for k in range(7)] if mode == OpenEXR.MIPMAP_LEVELS else [(i, j) for j in range(6) for i in range(7)]
    )
    table, body = [], b""
    for i, j in levels:
        width, height = sizes[0][i], sizes[1][j]
        level = np.zeros((height, width, 3), np.float32) if i or j else PICTURE[..., :3]
        for y in range(0, height, edge):
            for x in range(0, width, edge):
                tile = np.ascontiguousarray(level[y : y + edge, x : x + edge, ::-1].swapaxes(1, 2)).tobytes()
                table.append(at + 8 * chunks.count + len(body))
                body += struct.pack("<5i", x // edge, y // edge, i, j, len(tile)) + tile
    assert len(table) == chunks.count
    path.write_bytes(content[:at] + struct.pack(f"<{len(table)}Q", *table) + body)
    np.testing.assert_array_equal(read_exr(path).rgb, PICTURE[..., :3])
    path.write_bytes(path.read_bytes()[: at + 8 * chunks.count + 5000])
    with pytest.raises(BadInputError, match="cut off"):
        read_header(path)


def test_deep_pixels_are_refused(tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, PICTURE)
    content = bytearray(path.read_bytes())
    content[5] |= 0x08
    path.write_bytes(content)
    with pytest.raises(BadInputError, match="deep pixels.*flatten"):
        read_header(path)


def test_another_white_stays_white(tmp_path):
    aces = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
    write_with_library(tmp_path / "a.exr", planes_of(np.ones((4, 4, 3), np.float32)), chromaticities=aces)
    np.testing.assert_allclose(read_exr(tmp_path / "a.exr").rgb, 1, atol=1e-5)
    red = np.zeros((4, 4, 3), np.float32)
    red[..., 0] = 1
    write_with_library(tmp_path / "a.exr", planes_of(red), chromaticities=aces)
    # ACES 2065-1 to linear Rec.709, Bradford: the first column of the published matrix (colour-science.org).
    np.testing.assert_allclose(read_exr(tmp_path / "a.exr").rgb[0, 0], [2.52169, -0.27648, -0.01538], atol=2e-4)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.01, 0.3, 0.9, 0.9999])
def test_a_cut_off_file_is_found_by_its_header_alone(tmp_path, share):
    write_exr(tmp_path / "a.exr", PICTURE)
    content = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "a.exr").write_bytes(content[: int(len(content) * share)])
    for read in (read_header, read_exr):
        with pytest.raises(BadInputError, match="a.exr"):
            read(tmp_path / "a.exr")


def test_damaged_pixels(tmp_path, capfd):
    write_exr(tmp_path / "a.exr", np.round(PICTURE, 1))  # noise would be stored as it is, and any byte be right
    content = bytearray((tmp_path / "a.exr").read_bytes())
    content[len(content) // 2 : len(content) // 2 + 400] = b"\xff" * 400
    (tmp_path / "a.exr").write_bytes(content)
    with pytest.raises(BadInputError, match="a.exr' is damaged"):
        read_exr(tmp_path / "a.exr")


def patched(path, name: bytes, value: bytes):
    """Replace the content of the attribute `name`."""
    content = path.read_bytes()
    at = content.index(name) + len(name)
    at = content.index(b"\0", at + 1) + 5  # behind the type and the length
    path.write_bytes(content[:at] + value + content[at + len(value) :])


@pytest.mark.parametrize("window", [(0, 0, 2**31 - 1, 2**31 - 1), (0, 0, 9999, 9999), (0, 0, -1, 5), (5, 0, 0, 3)])
@pytest.mark.parametrize("name", [b"dataWindow", b"displayWindow"])
def test_a_hostile_size_is_refused_before_the_library_sees_it(tmp_path, monkeypatch, window, name):
    path = tmp_path / "a.exr"
    write_exr(path, PICTURE[:4, :4])
    patched(path, name, struct.pack("<4i", *window))
    monkeypatch.setattr(OpenEXR, "File", lambda *a, **k: pytest.fail("the library was asked"))
    with pytest.raises(BadInputError, match="a.exr"):
        read_exr(path)


def test_what_is_no_picture(tmp_path):
    (tmp_path / "empty.exr").touch()
    (tmp_path / "text.exr").write_text("hello " * 100)
    (tmp_path / "folder.exr").mkdir()
    os.mkfifo(tmp_path / "pipe.exr")
    wanted = {
        "empty": "is empty",
        "text": "not an OpenEXR",
        "folder": "not a file",
        "pipe": "not a file",
        "absent": "does not exist",
    }
    for name, words in wanted.items():
        with pytest.raises(BadInputError, match=words):
            read_exr(tmp_path / f"{name}.exr")


DAMAGED = """
import resource, sys, time
from pathlib import Path
from addon.core.io.exr import read_exr
from addon.core.errors import BadInputError
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
for path in sys.argv[1:]:
    started = time.monotonic()
    try:
        read_exr(Path(path))
    except BadInputError as error:
        assert path in str(error) and str(error).endswith(".") and "\\n" not in str(error), str(error)
    assert time.monotonic() - started < 10, path  # hangs, not slowness
# Not ru_maxrss: that outlives exec, so that it would count the test runner's own memory.
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
assert int(status["VmHWM"].split()[0]) < 400_000, "too much memory"
print("all", len(sys.argv) - 1)
"""


def test_no_damaged_file_crashes_hangs_or_fills_memory(shared):
    # One process of its own for all of them: a crash takes only that one along.
    paths = sorted(map(str, (shared / "data/exr/Damaged").iterdir()))
    assert len(paths) > 150
    done = subprocess.run(
        [sys.executable, "-c", DAMAGED, *paths], cwd=ROOT, capture_output=True, timeout=120, text=True, errors="replace"
    )
    assert done.returncode == 0 and f"all {len(paths)}" in done.stdout, done.stderr[-2000:]


def test_a_full_disk_leaves_the_old_picture_and_no_remains(tmp_path, monkeypatch):
    write_exr(tmp_path / "a.exr", np.zeros((4, 4)))
    before = (tmp_path / "a.exr").read_bytes()

    def full(fd):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StorageError, match="a.exr.*No space left"):
        write_exr(tmp_path / "a.exr", np.ones((4, 4)))
    assert [path.name for path in tmp_path.iterdir()] == ["a.exr"]
    assert (tmp_path / "a.exr").read_bytes() == before


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(StorageError):
        write_exr(tmp_path / "absent" / "a.exr", np.ones((4, 4)))


@pytest.mark.parametrize("shape", [(4,), (4, 4, 2), (4, 4, 3, 1), (0, 4)])
def test_a_wrong_shape_is_the_callers_mistake(tmp_path, shape):
    with pytest.raises(ValueError, match="write_exr"):
        write_exr(tmp_path / "a.exr", np.ones(shape))
