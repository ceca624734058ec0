"""Writing PNG with zlib alone, so that the page, textures and previews need no library."""

import base64
import struct
import zlib
from pathlib import Path

import numpy as np

from ..atomic import write_bytes
from ..kinds import Code

SIGNATURE = b"\x89PNG\r\n\x1a\n"
LEFT_NEIGHBOUR: Code[int] = 1  # filter: each byte less that of the pixel to its left; halves the size of photos


def png(image: np.ndarray, effort: int = 6) -> bytes:
    """`image`, (height, width, 3) uint8 or uint16 with row 0 the top, as a PNG file; `effort` is zlib's level."""
    if image.dtype not in (np.uint8, np.uint16) or image.ndim != 3 or image.shape[2] != 3:
        raise ValueError(f"png takes (h, w, 3) uint8 or uint16, not {image.shape} {image.dtype}")
    height, width, _ = image.shape
    size = image.dtype.itemsize
    stored = np.ascontiguousarray(image, image.dtype.newbyteorder(">")).view(np.uint8).reshape(height, width, -1)
    rows = np.empty((height, 1 + 3 * size * width), np.uint8)
    rows[:, 0] = LEFT_NEIGHBOUR
    rows[:, 1 : 1 + 3 * size] = stored[:, 0]
    rows[:, 1 + 3 * size :] = (stored[:, 1:] - stored[:, :-1]).reshape(height, -1)  # wraps around, as it should
    header = struct.pack(">IIBBBBB", width, height, 8 * size, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), effort)), (b"IEND", b""))
    return SIGNATURE + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def write_png(path: Path | str, image: np.ndarray) -> None:
    """Write `image`, as of `png`, in whole or not at all; raises `StorageError`."""
    write_bytes(path, png(image))


def data_address(image: np.ndarray) -> str:
    """The PNG as a data URL, which a page can embed."""
    return "data:image/png;base64," + base64.b64encode(png(image)).decode("ascii")
