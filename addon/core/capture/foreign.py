"""Pictures that need a decoder which the core has not: JPEG and TIFF. Their headers are read here.

Their pixels are read by whatever the caller brings (Blender), once, into files that the core can read: `copies.py`.
"""

from __future__ import annotations

import struct
from pathlib import Path

from ..errors import BadInputError
from .picture import MAX_PIXELS
from .tiff_tags import BITS, HEIGHT, ORDERS, SAMPLE_FORMAT, WIDTH, exposure_tags, read_tags

JPEG_MAGIC, TIFF_MAGIC = b"\xff\xd8\xff", tuple(ORDERS)
HEAD = 1 << 20
"""Bytes in which a header has to end; EXIF with a thumbnail has some 64 thousand."""
FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of JPEG that give the size."""
FLOAT = 3
"""TIFF's SampleFormat of floats."""


def is_foreign(head: bytes) -> bool:
    """Whether a file that begins with `head` is one of these."""
    return head.startswith((JPEG_MAGIC, *TIFF_MAGIC))


def foreign_info(path: Path) -> tuple[int, int, int]:
    """Width, height, and bits of a channel (0 for floats) of the JPEG or TIFF `path`; raises `BadInputError`."""
    data = _head(path)
    try:
        width, height, bits = _jpeg_info(data) if data.startswith(JPEG_MAGIC) else _tiff_info(data, path)
    except (ValueError, struct.error, IndexError) as error:
        raise BadInputError(f"Picture '{path}' is damaged or cut off; write or copy it again.") from error
    if not 0 < width * height <= MAX_PIXELS:
        raise BadInputError(f"Picture '{path}' claims {width} x {height} pixels; write it again.")
    return width, height, bits


def exif_exposure(path: Path) -> dict[int, float]:
    """Exposure time in seconds, f-number and ISO of the JPEG or TIFF `path`, by tag, as far as it tells."""
    data = _head(path)
    if not data.startswith(JPEG_MAGIC):
        try:
            return exposure_tags(*_directory(data, path))
        except (struct.error, KeyError):  # damaged, as its size will tell
            return {}
    at = data.find(b"Exif\0\0")
    return exposure_tags(data[at + 6 :]) if at >= 0 else {}


def _head(path: Path) -> bytes:
    try:
        with open(path, "rb") as file:
            return file.read(HEAD)
    except OSError as error:
        raise BadInputError(f"Picture '{path}' can't be read ({error.strerror or error}); check its rights.") from error


def _jpeg_info(data: bytes) -> tuple[int, int, int]:
    """Walk over the segments to the one that begins the frame (ITU-T T.81, B.2.2)."""
    at = 2
    while True:
        if data[at] != 0xFF:
            raise ValueError
        marker = data[at + 1]
        if marker == 0xFF:  # fill
            at += 1
        elif marker in FRAMES:
            bits, height, width = struct.unpack_from(">BHH", data, at + 4)
            if bits != 8:
                raise ValueError
            return width, height, 8
        elif marker == 0x01 or 0xD0 <= marker <= 0xD8:  # without content
            at += 2
        else:
            at += 2 + max(int.from_bytes(data[at + 2 : at + 4], "big"), 2)


def _directory(data: bytes, path: Path) -> tuple[bytes, int, str, int]:
    """The piece of a TIFF around its first directory, as `read_tags` takes it; `data` is the file's beginning."""
    order = ORDERS[data[:4]]
    (pointer,) = struct.unpack_from(order + "I", data, 4)
    base = 0
    if pointer + HEAD // 2 > len(data) >= HEAD:
        base = max(pointer - HEAD // 2, 0)
        with open(path, "rb") as file:  # the directory often follows the pixels
            file.seek(base)
            data = file.read(HEAD)
    return data, pointer, order, base


def _tiff_info(data: bytes, path: Path) -> tuple[int, int, int]:
    tags = read_tags(*_directory(data, path))
    bits = int(tags.get(BITS, 1))
    is_float = tags.get(SAMPLE_FORMAT) == FLOAT
    if bits not in ((16, 32) if is_float else (8, 16)):
        raise BadInputError(f"Picture '{path}' is a TIFF of {bits} bits, which isn't supported; write PNG or EXR.")
    return int(tags.get(WIDTH, 0)), int(tags.get(HEIGHT, 0)), 0 if is_float else bits
