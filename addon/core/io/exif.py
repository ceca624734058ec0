"""EXIF of JPEG and TIFF, which is a TIFF within a JPEG: exposure time, f-number, ISO and orientation.

OpenImageIO 3.0 leaves out the ISO of TIFF's EXIF, and frames of unlike ISO would come out as unlike light.
Source: TIFF 6.0, section 2; CIPA DC-008 (Exif 2.32), 4.6.5.
"""

import math
import mmap
import struct
from pathlib import Path

from ..kinds import Code, Limit
from .files import mapped, read_bytes, readable
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


def read_tags(data: bytes | mmap.mmap, pointer: int | None = None) -> dict[int, float]:
    """First value of each numeric tag in the directory at `pointer` of the TIFF `data`; None takes the first directory.

    Raises `ValueError` where `data` is no TIFF, or ends before its directory does.
    """
    order = ORDERS.get(data[:4])
    if order is None:
        raise ValueError("no TIFF")
    try:
        if pointer is None:
            (pointer,) = struct.unpack_from(order + "I", data, 4)
        (count,) = struct.unpack_from(order + "H", data, pointer)
        tags: dict[int, float] = {}
        for i in range(min(count, MAX_TAGS)):
            offset = pointer + 2 + 12 * i
            tag, value_type, value_count = struct.unpack_from(order + "HHI", data, offset)
            if value_type not in TYPES or not value_count:
                continue
            code, size = TYPES[value_type]
            offset += 8
            if value_count * size > 4:
                (offset,) = struct.unpack_from(order + "I", data, offset)
            if offset + size > len(data):
                continue  # beyond what was read of the file, as large tables are
            value = struct.unpack_from(order + code, data, offset)
            if value_type != 5:
                tags.setdefault(tag, value[0])
            elif value[1]:
                tags.setdefault(tag, value[0] / value[1])
    except struct.error as error:
        raise ValueError("ends within its tags") from error
    return tags


def exposure_tags(data: bytes | mmap.mmap) -> dict[int, float]:
    """Those of `EXPOSURE_TIME`, `F_NUMBER` and `ISO` that the EXIF of the TIFF `data` has; {} where it has none."""
    try:
        tags = read_tags(data)
        if 0 <= tags.get(EXIF, -1) < len(data):
            tags |= read_tags(data, int(tags[EXIF]))
    except ValueError:
        return {}
    return {tag: tags[tag] for tag in (EXPOSURE_TIME, F_NUMBER, ISO) if 0 < tags.get(tag, 0) < math.inf}


def exif_exposure(path: Path) -> dict[int, float]:
    """Exposure time in seconds, f-number and ISO of the JPEG, TIFF, DNG or HEIC `path`, by tag, as far as stated."""
    head = read_bytes(path, "Picture ", HEAD_BYTES)
    if is_heif(head):
        return exposure_tags(heif_exif(path))
    if head.startswith(JPEG_MAGIC):
        offset = head.find(b"Exif\0\0")
        return exposure_tags(head[offset + 6 :]) if offset >= 0 else {}
    if not head.startswith(tuple(ORDERS)):
        return {}
    with readable(f"Picture '{path}'"), mapped(path) as data:
        return exposure_tags(data)


def exif_orientation(path: Path) -> int:
    """EXIF's orientation of the TIFF or DNG `path`; 1 where it is not stated."""
    try:
        with readable(f"Picture '{path}'"), mapped(path) as data:
            return int(read_tags(data).get(ORIENTATION, 1))
    except (ValueError, OverflowError):
        return 1
