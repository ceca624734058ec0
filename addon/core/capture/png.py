"""PNG, as far as masks and previews need it, with zlib alone: Blender's Python brings no picture library."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from ..atomic import write_bytes
from ..errors import BadInputError

MAGIC = b"\x89PNG\r\n\x1a\n"
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # gray, RGB, palette, gray and alpha, RGBA
MAX_PIXELS = 1 << 27


def png_size(path: Path | str) -> tuple[int, int]:
    """Width and height of the PNG `path`, from its header alone; raises `BadInputError`."""
    return _header(_read(path, 33), path)[:2]


def read_png(path: Path | str) -> np.ndarray:
    """Read the PNG `path` of up to 8 bits a channel.

    Returns
    -------
    (h, w, c) uint8
        c is 1 (gray), 2 (gray, alpha), 3 or 4. A palette is looked up; 1, 2 and 4 bits are scaled to 0...255.

    Raises
    ------
    BadInputError
        Absent, damaged, interlaced, or of 16 bits.
    """
    content = _read(path)
    width, height, bits, colour = _header(content, path)
    channels = CHANNELS[colour]
    packed, palette, at = [], None, 8
    while at + 8 <= len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        if kind == b"IDAT":
            packed.append(content[at + 8 : at + 8 + length])
        elif kind == b"PLTE":
            palette = np.frombuffer(content[at + 8 : at + 8 + length // 3 * 3], np.uint8).reshape(-1, 3)
        at += 12 + length
    stride = (width * channels * bits + 7) // 8
    try:
        raw = zlib.decompressobj().decompress(b"".join(packed), height * (stride + 1))
    except zlib.error:
        raw = b""
    if len(raw) != height * (stride + 1):
        raise BadInputError(f"Picture '{path}' is damaged or cut off; write or copy it again.")
    rows = np.frombuffer(raw, np.uint8).reshape(height, stride + 1)
    if rows[:, 0].max() > 4:
        raise BadInputError(f"Picture '{path}' is damaged; write or copy it again.")
    lines = _unfilter(rows, max(channels * bits // 8, 1))
    if bits < 8:
        split = np.unpackbits(lines, axis=1).reshape(height, -1, bits)
        lines = (split * (1 << np.arange(bits)[::-1])).sum(-1).astype(np.uint8)
        if colour != 3:
            lines = lines * np.uint8(255 // ((1 << bits) - 1))
    pixels = lines[:, : width * channels].reshape(height, width, channels)
    if colour != 3:
        return pixels
    if palette is None or pixels.max() >= len(palette):
        raise BadInputError(f"Picture '{path}' is damaged (its palette is too short); write it again.")
    return palette[pixels[..., 0]]


def write_png(path: Path | str, array: np.ndarray) -> None:
    """Write `array` ((h, w, 3) uint8, row 0 the top), in whole or not at all; raises `StorageError`."""
    array = np.ascontiguousarray(array)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] != 3:
        raise ValueError(f"write_png takes (h, w, 3) uint8, not {array.shape} {array.dtype}")
    height, width = array.shape[:2]
    rows = np.zeros((height, width * 3 + 1), np.uint8)
    rows[:, 1:] = array.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
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


def _header(content: bytes, path: Path | str) -> tuple[int, int, int, int]:
    """Width, height, bits and kind of colour."""
    if content[:8] != MAGIC or content[12:16] != b"IHDR" or len(content) < 33:
        raise BadInputError(f"Picture '{path}' is not a PNG file; write masks as PNG or OpenEXR.")
    width, height, bits, colour, _, _, interlaced = struct.unpack(">IIBBBBB", content[16:29])
    if not 0 < width * height <= MAX_PIXELS:
        raise BadInputError(f"Picture '{path}' claims {width} x {height} pixels; write it again.")
    if interlaced or colour not in CHANNELS or bits not in ((1, 2, 4, 8) if colour in (0, 3) else (8,)):
        raise BadInputError(f"Picture '{path}' is an interlaced or {bits}-bit PNG, which isn't supported; "
                            "write it plain with 8 bits.")
    return width, height, bits, colour


def _unfilter(rows: np.ndarray, step: int) -> np.ndarray:
    """Undo the filters of PNG: `rows` (h, 1 + n) uint8, the filter first; `step` bytes from pixel to pixel."""
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
        elif kind > 2:
            line = _predict(kind, line.tolist(), above.tolist(), step)
        result[y] = above = np.asarray(line, np.uint8)
    return result


def _predict(kind: int, line: list[int], above: list[int], step: int) -> list[int]:
    """Average and Paeth: each byte needs the one to its left, so they can't be done at once."""
    for i, value in enumerate(line):
        left = line[i - step] if i >= step else 0
        up = above[i]
        if kind == 3:
            line[i] = (value + (left + up) // 2) & 255
            continue
        corner = above[i - step] if i >= step else 0
        a, b, c = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
        line[i] = (value + (left if a <= b and a <= c else up if b <= c else corner)) & 255
    return line
