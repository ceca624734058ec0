"""EXIF of JPEG and TIFF, which is a TIFF within a JPEG: exposure time, f-number, ISO and orientation.

OpenImageIO 3.0 leaves out the ISO of TIFF's EXIF, and frames of unlike ISO would come out as unlike light.
Source: TIFF 6.0, section 2; CIPA DC-008 (Exif 2.32), 4.6.5.
"""

import math
import struct
from pathlib import Path

from ..kinds import Code, Limit
from .files import read_bytes
from .heif import heif_exif, is_heif

EXIF: Code[int] = 0x8769
ORIENTATION: Code[int] = 0x112
EXPOSURE_TIME: Code[int] = 0x829A
F_NUMBER: Code[int] = 0x829D
ISO: Code[int] = 0x8827
ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
JPEG_MAGIC = b"\xff\xd8\xff"
HEAD_BYTES: Limit[int] = 1 << 20
"""Bytes in which a JPEG's EXIF has to end; with a thumbnail it has some 64 thousand."""
MAX_TAGS: Limit[int] = 4096
TYPES = {1: ("B", 1), 3: ("H", 2), 4: ("I", 4), 5: ("II", 8), 11: ("f", 4), 12: ("d", 8)}
"""Byte, short, long, rational, float and double: how `struct` reads them, and their bytes."""


def read_tags(data: bytes, pointer: int | None = None, order: str = "", base: int = 0) -> dict[int, float]:
    """First value of each numeric tag in the directory at `pointer` of the TIFF `data`; None takes the first directory.

    Parameters
    ----------
    order, base : str, int
        Of a piece of a file that begins at `base`: its byte order ('<' or '>'). '' takes it from the beginning.

    Raises
    ------
    ValueError
        `data` is no TIFF, or ends before its directory does.
    """
    order = order or ORDERS.get(data[:4], "")
    if not order:
        raise ValueError("no TIFF")
    try:
        if pointer is None:
            (pointer,) = struct.unpack_from(order + "I", data, 4)
        if pointer < base:
            raise ValueError("begins before what was read of the file")
        (count,) = struct.unpack_from(order + "H", data, pointer - base)
        tags: dict[int, float] = {}
        for i in range(min(count, MAX_TAGS)):
            offset = pointer - base + 2 + 12 * i
            tag, value_type, value_count = struct.unpack_from(order + "HHI", data, offset)
            if value_type not in TYPES or not value_count:
                continue
            code, size = TYPES[value_type]
            if value_count * size > 4:
                (offset,) = struct.unpack_from(order + "I", data, offset + 8)
                offset -= base
            else:
                offset += 8
            if offset < 0 or offset + size > len(data):
                continue  # beyond what was read of the file, as large tables are
            value = struct.unpack_from(order + code, data, offset)
            if value_type != 5:
                tags.setdefault(tag, value[0])
            elif value[1]:
                tags.setdefault(tag, value[0] / value[1])
    except struct.error as error:
        raise ValueError("ends within its tags") from error
    return tags


def exposure_tags(data: bytes, pointer: int | None = None, order: str = "", base: int = 0) -> dict[int, float]:
    """Those of `EXPOSURE_TIME`, `F_NUMBER` and `ISO` that the EXIF of the TIFF `data` has; {} where it has none.

    Parameters as of `read_tags`.
    """
    try:
        tags = read_tags(data, pointer, order, base)
        if EXIF in tags:
            tags |= read_tags(data, int(tags[EXIF]), order, base)
    except ValueError:
        return {}
    return {tag: tags[tag] for tag in (EXPOSURE_TIME, F_NUMBER, ISO) if 0 < tags.get(tag, 0) < math.inf}


def exif_exposure(path: Path) -> dict[int, float]:
    """Exposure time in seconds, f-number and ISO of the JPEG, TIFF, DNG or HEIC `path`, by tag, as far as stated."""
    data = read_bytes(path, "Picture ", HEAD_BYTES)
    if is_heif(data):
        return exposure_tags(heif_exif(path))
    if not data.startswith(JPEG_MAGIC):
        try:
            return exposure_tags(*_directory(data, path))
        except (struct.error, KeyError):  # damaged: reported when its size is read
            return {}
    offset = data.find(b"Exif\0\0")
    return exposure_tags(data[offset + 6 :]) if offset >= 0 else {}


def exif_orientation(path: Path) -> int:
    """EXIF's orientation of the TIFF or DNG `path`; 1 where it is not stated."""
    try:
        return int(read_tags(*_directory(read_bytes(path, "Picture ", HEAD_BYTES), path)).get(ORIENTATION, 1))
    except (struct.error, KeyError, ValueError, OverflowError):
        return 1


def _directory(data: bytes, path: Path) -> tuple[bytes, int, str, int]:
    """The piece of a TIFF around its first directory, as `read_tags` takes it; `data` is the file's beginning."""
    order = ORDERS[data[:4]]
    (pointer,) = struct.unpack_from(order + "I", data, 4)
    base = 0
    if pointer + HEAD_BYTES // 2 > len(data) >= HEAD_BYTES:
        base = max(pointer - HEAD_BYTES // 2, 0)
        with open(path, "rb") as file:  # the directory often follows the pixels
            file.seek(base)
            data = file.read(HEAD_BYTES)
    return data, pointer, order, base
