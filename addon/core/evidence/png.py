"""Writes small PNGs for the page."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np

SIGNATURE = b"\x89PNG\r\n\x1a\n"
LEFT_NEIGHBOUR = 1  # filter type: each byte less that of the pixel to its left, which halves the size of photos


def png(image: np.ndarray) -> bytes:
    """(height, width, 3) uint8 as a PNG file."""
    height, width, _ = image.shape
    rows = np.empty((height, 1 + 3 * width), np.uint8)
    rows[:, 0] = LEFT_NEIGHBOUR
    rows[:, 1:4] = image[:, 0]
    rows[:, 4:] = (image[:, 1:] - image[:, :-1]).reshape(height, -1)  # wraps around, as it should
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
    return SIGNATURE + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def data_address(image: np.ndarray) -> str:
    """The same as an address that a page can hold in itself."""
    return "data:image/png;base64," + base64.b64encode(png(image)).decode("ascii")
