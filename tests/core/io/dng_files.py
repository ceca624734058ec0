"""A DNG as cameras write it: a Bayer mosaic of 12 bits in 16, black level, colour matrix, EXIF."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

BLACK, WHITE = 64, 4095
TO_CAMERA = np.linalg.inv([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""From XYZ to a camera whose colours are linear Rec.709."""


def write_dng(path: Path, linear: np.ndarray, orientation: int = 1, seconds: float = 0.01) -> None:
    """Write `linear`, (h, w, 3) with even sides, 1 where the sensor clips."""
    height, width = linear.shape[:2]
    mosaic = np.empty((height, width))
    for y, x, channel in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
        mosaic[y::2, x::2] = linear[y::2, x::2, channel]
    codes = np.clip(np.rint(BLACK + mosaic * (WHITE - BLACK)), 0, WHITE).astype("<u2").tobytes()
    matrix = b"".join(struct.pack("<ii", round(value * 10_000), 10_000) for value in TO_CAMERA.ravel())
    short, long, one = (lambda v: struct.pack("<H", v)), (lambda v: struct.pack("<I", v)), struct.pack("<II", 1, 1)
    tags = {
        256: (4, long(width)), 257: (4, long(height)), 258: (3, short(16)), 259: (3, short(1)), 262: (3, short(32803)),
        271: (2, b"Maker\0"), 272: (2, b"Model\0"), 273: (4, b"data"), 274: (3, short(orientation)), 277: (3, short(1)),
        278: (4, long(height)), 279: (4, long(len(codes))), 33421: (3, struct.pack("<2H", 2, 2)),
        33422: (1, bytes((0, 1, 1, 2))), 34665: (4, b"exif"), 50706: (1, bytes((1, 4, 0, 0))), 50708: (2, b"Model\0"),
        50714: (3, short(BLACK)), 50717: (3, short(WHITE)), 50721: (10, matrix), 50728: (5, 3 * one),
        50778: (3, short(21)),
    }  # fmt: skip
    end = 8 + 2 + 12 * len(tags) + 4
    sizes = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 10: 8}
    more = {tag: value for tag, (_, value) in tags.items() if len(value) > 4}
    places = {tag: end + sum(len(more[t]) for t in sorted(more) if t < tag) for tag in more}
    exif_at = end + sum(map(len, more.values()))
    exif = (
        struct.pack("<HHHII", 1, 0x829A, 5, 1, exif_at + 18)
        + bytes(4)
        + struct.pack("<II", round(seconds * 1e6), 10**6)
    )
    entries = b""
    for tag, (kind, value) in sorted(tags.items()):
        count = len(value) // sizes[kind]
        if value in (b"data", b"exif"):
            value, count = long(exif_at + (len(exif) if value == b"data" else 0)), 1
        entries += struct.pack("<HHI", tag, kind, count) + (long(places[tag]) if tag in more else value.ljust(4, b"\0"))
    head = b"II*\0" + long(8) + struct.pack("<H", len(tags)) + entries + bytes(4)
    path.write_bytes(head + b"".join(more[tag] for tag in sorted(more)) + exif + codes)
