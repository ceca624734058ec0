"""PNG with zlib alone: Blender's Python brings no picture library that every thread may use.

Chunks for transparent colours (tRNS) and curves (gAMA, sRGB, iCCP) are not heeded. Source: W3C, PNG, third edition.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from ..atomic import write_bytes
from ..errors import BadInputError
from .picture import MAX_PIXELS

MAGIC = b"\x89PNG\r\n\x1a\n"
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # gray, RGB, palette, gray and alpha, RGBA
ADAM7 = ((0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1))
"""First row and column, and the steps to the next, of each pass of an interlaced picture."""
BITS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
"""Depths that each kind of colour may have."""
MAX_RATIO = 1100
"""No PNG packs more bytes of pixels than this into one of the file: deflate's limit is 1032."""


def png_size(path: Path | str) -> tuple[int, int]:
    """Width and height of the PNG `path`, from its header alone; raises `BadInputError`."""
    return _header(_read(path, 33), path)[:2]


def png_bits(path: Path | str) -> int:
    """Bits of a channel of what `read_png` would give, 8 or 16; raises `BadInputError`."""
    return 16 if _header(_read(path, 33), path)[2] == 16 else 8


def read_png(path: Path | str) -> np.ndarray:
    """Read the PNG `path`, of any depth and kind of colour, interlaced or not.

    Returns
    -------
    (h, w, c) uint8 or uint16
        c is 1 (gray), 2 (gray, alpha), 3 or 4. A palette is looked up; 1, 2 and 4 bits are scaled to 0...255.

    Raises
    ------
    BadInputError
        Absent, damaged or cut off.
    """
    content = _read(path)
    width, height, bits, colour, interlaced = _header(content, path)
    channels = CHANNELS[colour]
    packed, palette, at = [], None, 8
    while at + 8 <= len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        if kind == b"IDAT":
            packed.append(content[at + 8 : at + 8 + length])
        elif kind == b"PLTE":
            palette = np.frombuffer(content[at + 8 : at + 8 + length // 3 * 3], np.uint8)
            palette = palette[: len(palette) // 3 * 3].reshape(-1, 3)
        at += 12 + length
    passes = [(y, x, dy, dx) for y, x, dy, dx in (ADAM7 if interlaced else ((0, 0, 1, 1),)) if x < width and y < height]
    shapes = [(-(-(height - y) // dy), (-(-(width - x) // dx) * channels * bits + 7) // 8) for y, x, dy, dx in passes]
    total = sum(rows * (stride + 1) for rows, stride in shapes)
    try:
        raw = zlib.decompressobj().decompress(b"".join(packed), total)
    except zlib.error:
        raw = b""
    if len(raw) != total:
        raise BadInputError(f"Picture '{path}' is damaged or cut off; write or copy it again.")
    pixels = np.empty((height, width, channels), np.uint16 if bits == 16 else np.uint8)
    at = 0
    for (rows, stride), (y, x, dy, dx) in zip(shapes, passes):
        filtered = np.frombuffer(raw, np.uint8, rows * (stride + 1), at).reshape(rows, stride + 1)
        at += filtered.size
        if filtered[:, 0].max() > 4:
            raise BadInputError(f"Picture '{path}' is damaged; write or copy it again.")
        lines = _unfilter(filtered, max(channels * bits // 8, 1))
        target = pixels[y::dy, x::dx]
        target[:] = _samples(lines, bits, colour)[:, : target.shape[1] * channels].reshape(target.shape)
    if colour != 3:
        return pixels
    if palette is None or pixels.max() >= len(palette):
        raise BadInputError(f"Picture '{path}' is damaged (its palette is too short); write it again.")
    return palette[pixels[..., 0]]


def write_png(path: Path | str, array: np.ndarray, level: int = 6) -> None:
    """Write `array` ((h, w, 3) uint8 or uint16, row 0 the top), in whole or not at all; raises `StorageError`.

    `level` is zlib's: 1 is five times as fast as 6, and the file a tenth larger.
    """
    array = np.ascontiguousarray(array)
    if array.dtype not in (np.uint8, np.uint16) or array.ndim != 3 or array.shape[2] != 3:
        raise ValueError(f"write_png takes (h, w, 3) uint8 or uint16, not {array.shape} {array.dtype}")
    height, width = array.shape[:2]
    stored = array.reshape(height, -1).astype(array.dtype.newbyteorder(">")).view(np.uint8)
    rows = np.zeros((height, stored.shape[1] + 1), np.uint8)
    rows[:, 1:] = stored
    header = struct.pack(">IIBBBBB", width, height, array.dtype.itemsize * 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), level)), (b"IEND", b""))
    write_bytes(path, MAGIC, *(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
                               for kind, data in chunks))


def _read(path: Path | str, limit: int = -1) -> bytes:
    try:
        if not Path(path).is_file():
            raise BadInputError(f"Picture '{path}' is not there; check the capture's paths.")
        with open(path, "rb") as file:
            return file.read(limit)
    except OSError as error:
        raise BadInputError(f"Picture '{path}' can't be read ({error.strerror or error}); check its rights.") from error


def _header(content: bytes, path: Path | str) -> tuple[int, int, int, int, bool]:
    """Width, height, bits, kind of colour, and whether it is interlaced."""
    if content[:8] != MAGIC or content[12:16] != b"IHDR" or len(content) < 33:
        raise BadInputError(f"Picture '{path}' is not a PNG file; write masks as PNG or OpenEXR.")
    width, height, bits, colour, packing, filters, interlaced = struct.unpack(">IIBBBBB", content[16:29])
    if not 0 < width * height <= MAX_PIXELS:
        raise BadInputError(f"Picture '{path}' claims {width} x {height} pixels; write it again.")
    if bits not in BITS.get(colour, ()) or packing or filters or interlaced > 1:
        raise BadInputError(f"Picture '{path}' has a damaged header; write or copy it again.")
    if width * height * CHANNELS[colour] * bits // 8 > max(1 << 16, MAX_RATIO * Path(path).stat().st_size):
        raise BadInputError(f"Picture '{path}' claims {width} x {height} pixels, more than it can hold; it is damaged "
                            "or cut off, so write or copy it again.")
    return width, height, bits, colour, bool(interlaced)


def _samples(lines: np.ndarray, bits: int, colour: int) -> np.ndarray:
    """(rows, n) numbers from the bytes of the lines; those of less than 8 bits are scaled up, but for a palette's."""
    if bits == 16:
        return lines.view(">u2")
    if bits == 8:
        return lines
    split = np.unpackbits(lines, axis=1).reshape(len(lines), -1, bits)
    samples = (split * (1 << np.arange(bits)[::-1])).sum(-1).astype(np.uint8)
    return samples if colour == 3 else samples * np.uint8(255 // ((1 << bits) - 1))


def _unfilter(rows: np.ndarray, step: int) -> np.ndarray:
    """Undo the filters of PNG: `rows` (h, 1 + n) uint8, the filter first; `step` bytes from pixel to pixel."""
    if rows[:, 0].max() > 2:
        return _unfilter_diagonally(rows, step)
    result = np.zeros((len(rows), rows.shape[1] - 1), np.uint8)
    above = np.zeros(rows.shape[1] - 1, np.uint8)
    for y, row in enumerate(rows):
        kind, line = row[0], row[1:]
        if kind == 1:
            padded = np.zeros(-(-len(line) // step) * step, np.uint8)
            padded[: len(line)] = line
            line = np.cumsum(padded.reshape(-1, step), 0, dtype=np.uint8).ravel()[: len(line)]
        elif kind == 2:
            line = line + above
        result[y] = above = line
    return result


def _unfilter_diagonally(rows: np.ndarray, step: int) -> np.ndarray:
    """As `_unfilter`, for all filters.

    Average and Paeth need the byte to the left decoded, so no line can be done at once. Pixels of one diagonal don't
    need each other: (y, d - y) needs those of d - 1 and d - 2 alone.
    """
    height, width = len(rows), -(-(rows.shape[1] - 1) // step)
    raw = np.zeros((height, width * step), np.int16)
    raw[:, : rows.shape[1] - 1] = rows[:, 1:]
    raw = raw.reshape(height * width, step)
    # A row above and a column to the left hold the zeros that the standard has there.
    wide = width + 1
    done = np.zeros(((height + 1) * wide, step), np.int16)
    kinds = rows[:, :1].astype(np.int16)
    sub, up, average, paeth = (kinds == k for k in (1, 2, 3, 4))
    for d in range(height + width - 1):
        y0, y1 = max(0, d - width + 1), min(height, d + 1)
        here = slice(d + y0 * (width - 1), d + (y1 - 1) * (width - 1) + 1, max(width - 1, 1))
        # Pixel (y, x) lies at (y + 1) * wide + x + 1 in `done`; its neighbours at fixed distances before it.
        first = (y0 + 1) * wide + d - y0 + 1
        last = (y1 - 1 + 1) * wide + d - (y1 - 1) + 1
        gap = max(wide - 1, 1)
        a, b, c = (done[first - back : last - back + 1 : gap] for back in (1, wide, wide + 1))
        own = slice(y0, y1)
        p, q = b - c, a - c  # distances of Paeth's estimate a + b - c from a and from b
        pa, pb, pc = abs(p), abs(q), abs(p + q)
        nearest = np.where((pa <= pb) & (pa <= pc), a, np.where(pb <= pc, b, c))
        guess = (sub[own] * a + up[own] * b + average[own] * ((a + b) >> 1) + paeth[own] * nearest)
        done[first : last + 1 : gap] = (raw[here] + guess) & 255
    result = done.reshape(height + 1, wide, step)[1:, 1:].astype(np.uint8).reshape(height, -1)
    return np.ascontiguousarray(result[:, : rows.shape[1] - 1])
