"""PNG, JPEG, TIFF, HEIC and DNG files spoiled in every way."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.io.png import write_png
from tests.core.io.hostile.blows import read_spoiled, tells_memory
from tests.core.io.hostile.cases import png_content, tiff_content
from tests.core.io.test_phone_pictures import WRITERS

pillow = pytest.importorskip("PIL.Image")
PICTURE = np.random.default_rng(5).integers(0, 256, (33, 41, 3), np.uint8)

KINDS = {
    "png": lambda path: write_png(path, PICTURE.astype(np.uint16) * 257),
    "interlaced.png": lambda path: path.write_bytes(png_content()),
    "palette.png": lambda path: pillow.fromarray(PICTURE).convert("P").save(path),
    "jpg": lambda path: pillow.fromarray(PICTURE).save(path),
    "progressive.jpg": lambda path: pillow.fromarray(PICTURE).save(path, progressive=True),
    "tif": lambda path: path.write_bytes(tiff_content()),
    **{
        f"{name}.tif": lambda path, name=name: pillow.fromarray(PICTURE).save(path, compression=name)
        for name in ("tiff_lzw", "tiff_adobe_deflate", "packbits", "jpeg")
    },
    "float.tif": lambda path: pillow.fromarray(PICTURE[..., 0].astype(np.float32)).save(path, compression="tiff_lzw"),
}


@tells_memory
@pytest.mark.parametrize("kind", KINDS)
def test_spoiled(kind, tmp_path):
    KINDS[kind](tmp_path / f"good.{kind}")
    read_spoiled(tmp_path / f"good.{kind}", 400, "coded")


@tells_memory
@pytest.mark.parametrize("kind", WRITERS)
def test_what_phones_write_spoiled(kind, tmp_path):
    WRITERS[kind](tmp_path / f"good.{kind}")
    read_spoiled(tmp_path / f"good.{kind}", 700, "phone")
