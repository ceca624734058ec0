"""OpenEXR files spoiled in every way."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest

from tests.core.io.hostile.blows import read_spoiled, tells_memory

PICTURE = np.round(np.random.default_rng(5).random((33, 41, 3)), 1).astype(np.float16)


def planes(prefix: str = "") -> dict[str, np.ndarray]:
    """New ones each time, as the library makes its own of those that it is given."""
    return {f"{prefix}{c}": np.ascontiguousarray(PICTURE[..., i]) for i, c in enumerate("RGB")}


def one_part(path, **header):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    OpenEXR.File(header, planes()).write(str(path))


def tiled(path):
    tiles = OpenEXR.TileDescription()
    tiles.xSize, tiles.ySize = 16, 16
    one_part(path, type=OpenEXR.tiledimage, tiles=tiles)


def parts(path):
    both = [OpenEXR.Part({}, planes(), "rgba"), OpenEXR.Part({}, planes("diffuse."), "other")]
    OpenEXR.File(both).write(str(path))


KINDS = {
    "scanlines": one_part,
    "tiles": tiled,
    "parts": parts,
    **{
        name: lambda path, name=name: one_part(path, compression=getattr(OpenEXR, f"{name}_COMPRESSION"))
        for name in ("PIZ", "PXR24", "B44", "DWAA", "HTJ2K32", "ZSTD")
        if hasattr(OpenEXR, f"{name}_COMPRESSION")
    },
}


@tells_memory
@pytest.mark.parametrize("kind", KINDS)
def test_spoiled(kind, tmp_path):
    KINDS[kind](tmp_path / "good.exr")
    read_spoiled(tmp_path / "good.exr", 800, "exr")
