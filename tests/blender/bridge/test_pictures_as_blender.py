"""Pictures that Blender wrote, and EXR beside Blender's own reader."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.exr import read_exr
from addon.core.io.oiio import coded_header, read_coded

SHARED = Path(__file__).resolve().parents[4] / "shared"
CODES = np.repeat(np.repeat(np.random.default_rng(0).integers(20, 230, (3, 4, 3), np.uint8), 8, 0), 8, 1)


def saved(path: Path, kind: str, depth: str = "8", values=CODES / 255.0) -> Path:
    """Write `values` as Blender writes pictures of the kind, no colours managed."""
    height, width = values.shape[:2]
    image = bpy.data.images.new("a", width, height, float_buffer=depth != "8", is_data=True)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = values[::-1]
    image.pixels.foreach_set(pixels.ravel())
    scene = bpy.context.scene
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = kind, "RGB", depth
    settings.quality, settings.color_management = 100, "OVERRIDE"
    settings.linear_colorspace_settings.name = "Non-Color"
    image.save_render(str(path), scene=scene)
    bpy.data.images.remove(image)
    return path


def test_jpeg(tmp_path):
    path = saved(tmp_path / "a.jpg", "JPEG")
    got = read_coded(path).colour
    assert got.dtype == np.uint8 and got.shape == CODES.shape
    error = abs(got.astype(int) - CODES)
    assert np.median(error) <= 2 and error.mean() < 10  # the chroma of a JPEG is halved


@pytest.mark.parametrize("depth, dtype", [("8", np.uint8), ("16", np.uint16)])
def test_tiff(tmp_path, depth, dtype):
    path = saved(tmp_path / "a.tif", "TIFF", depth)
    got = read_coded(path).colour
    assert coded_header(path) == (32, 24, int(depth)) and got.dtype == dtype
    np.testing.assert_allclose(got / np.iinfo(dtype).max, CODES / 255, atol=0.003)


@pytest.mark.parametrize("kept", [200, -500, -2])
def test_a_damaged_jpeg(tmp_path, kept):
    path = saved(tmp_path / "a.jpg", "JPEG")
    content = path.read_bytes()
    path.write_bytes(content[:kept])
    with pytest.raises(BadInputError, match="a.jpg"):
        read_coded(path)


def blenders(path: Path) -> np.ndarray:
    """The data window as Blender reads it."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(image.size[1], image.size[0], image.channels)[::-1, :, :3]
    bpy.data.images.remove(image)
    return values


@pytest.mark.parametrize("folder", ["TestImages", "DisplayWindow", "Chromaticities"])
def test_exr_is_read_as_blender_reads_it(folder):
    if not SHARED.is_dir():
        pytest.skip(f"{SHARED} is absent")
    compared = 0
    for path in sorted((SHARED / "data/exr" / folder).glob("*.exr")):
        if "_YC" in path.name or path.stem in ("XYZ", "WideFloatRange"):
            continue  # Blender does not read chroma, converts no primaries; one channel G is no picture
        mine, theirs = read_exr(path).rgb, blenders(path)
        if folder == "DisplayWindow":  # Blender gives the data window; where both are, they lie at one place
            left, top = WINDOWS[path.stem]
            placed = np.full((mine.shape[0] + 2 * 600, mine.shape[1] + 2 * 600, 3), np.nan, np.float32)
            placed[600 + top : 600 + top + theirs.shape[0], 600 + left : 600 + left + theirs.shape[1]] = theirs
            theirs = placed[600:-600, 600:-600]
        np.testing.assert_array_equal(mine, theirs)  # to the bit, NaN and inf among them
        compared += 1
    assert compared >= {"TestImages": 8, "DisplayWindow": 16, "Chromaticities": 1}[folder]


WINDOWS = {
    "t01": (0, 0),
    "t02": (-1, -1),
    "t03": (-30, -20),
    "t04": (0, 0),
    "t05": (-30, -20),
    "t06": (1, 1),
    "t07": (40, 40),
    "t08": (30, 40),
    "t09": (-400, 0),
    "t10": (100, 0),
    "t11": (0, -300),
    "t12": (0, 100),
    "t13": (-399, -299),
    "t14": (100, 100),
    "t15": (40, 40),
    "t16": (40, 40),
}
"""Where the data begins in the display window, by the files' README."""
