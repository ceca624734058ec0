"""Tags of TIFF and of EXIF, which is a TIFF within a JPEG: sizes, and how long and how wide a camera was open.

Source: TIFF 6.0, section 2; CIPA DC-008 (Exif 2.32), 4.6.5.
"""

from __future__ import annotations

import math
import struct

WIDTH, HEIGHT, BITS, SAMPLE_FORMAT, EXIF = 256, 257, 258, 339, 0x8769
EXPOSURE_TIME, F_NUMBER, ISO = 0x829A, 0x829D, 0x8827
ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
MAX_TAGS = 4096
TYPES = {3: ("H", 2), 4: ("I", 4), 5: ("II", 8), 11: ("f", 4), 12: ("d", 8)}  # short, long, rational, float, double


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
            at = pointer - base + 2 + 12 * i
            tag, kind, number = struct.unpack_from(order + "HHI", data, at)
            if kind not in TYPES or not number:
                continue
            code, size = TYPES[kind]
            if number * size > 4:
                (at,) = struct.unpack_from(order + "I", data, at + 8)
                at -= base
            else:
                at += 8
            if at < 0 or at + size > len(data):
                continue  # beyond what was read of the file, as large tables are
            value = struct.unpack_from(order + code, data, at)
            if kind != 5:
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
