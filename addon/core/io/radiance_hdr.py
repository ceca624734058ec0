"""Radiance's pictures (.hdr, .pic): four bytes a pixel, a mantissa for each channel and one exponent.

Layout and formulas: G. Ward, "Real Pixels", Graphics Gems II, 1991; Radiance's `filefmts.pdf` and `color.h`.
"""

import math
import re
from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..json_values import float_of
from ..kinds import Code, Limit
from .files import read_bytes
from .picture import MAX_PIXELS, Picture
from .primaries import CIE_XYZ, to_rec709

MAGIC = (b"#?RADIANCE", b"#?RGBE", b"#?AUTOPANO")
HEADER_BYTES: Limit[int] = 1 << 16
RGBE, XYZE = b"32-bit_rle_rgbe", b"32-bit_rle_xyze"
XYZE_CHROMATICITIES = (*CIE_XYZ, 1 / 3, 1 / 3)
WHITE_EFFICACY: Code[float] = 179.0
"""Lumens for a watt of white light: RGBE holds W/(sr m2), XYZE holds cd/m2 (`WHTEFFICACY` in color.h)."""
RESOLUTION = re.compile(rb"([+-])([XY]) +(\d{1,9}) +([+-])([XY]) +(\d{1,9})[ \r]*\n")
RUNS: Code[tuple[int, int]] = (8, 0x7FFF)
"""Only lines of this many pixels may be stored channel by channel."""
MAX_RATIO: Limit[int] = 256
"""Pixels for a byte of the file; more claims a size that only a file made to fill memory holds."""


class _Header:
    """What a header says: `size`, the order of the lines, the format, and what values are to be divided by."""

    def __init__(self, head: bytes, path: Path):
        if not head.startswith(MAGIC):
            raise BadInputError(f"Picture '{path}' is not a Radiance picture; write it again.")
        end = head.find(b"\n\n")
        match = RESOLUTION.match(head, end + 2) if end > 0 else None
        if match is None or match[2] == match[5]:
            raise BadInputError(f"Picture '{path}' has a damaged header; write or copy it again.")
        self.end = match.end()
        self.signs, self.rows_first = (match[1], match[4]), match[2] == b"Y"
        self.major, self.minor = int(match[3]), int(match[6])
        self.size = (self.minor, self.major) if self.rows_first else (self.major, self.minor)
        if not 0 < self.major * self.minor <= MAX_PIXELS:
            raise BadInputError(f"Picture '{path}' claims {self.size[0]} x {self.size[1]} pixels; write it again.")
        self.format, self.chromaticities = RGBE, None
        self.scale = np.ones(3)
        for line in head[:end].split(b"\n")[1:]:
            key, separator, value = line.partition(b"=")
            if not separator or line.startswith((b"#", b" ", b"\t")):
                continue  # a command line or a comment
            if key == b"FORMAT":
                self.format = value.strip()
            elif key == b"EXPOSURE":  # these two are cumulative
                self.scale = self.scale * _numbers(value, 1, path)
            elif key == b"COLORCORR":
                self.scale = self.scale * _numbers(value, 3, path)
            elif key == b"PRIMARIES":
                self.chromaticities = tuple(_numbers(value, 8, path).tolist())
        if self.format not in (RGBE, XYZE):
            raise BadInputError(
                f"Picture '{path}' has the format '{self.format[:40].decode('latin-1')}', which isn't "
                "supported; write it as RGBE."
            )
        if not ((self.scale > 1e-30) & (self.scale < 1e30)).all():
            raise BadInputError(f"Picture '{path}' states an EXPOSURE or COLORCORR that can't be; write it again.")


def hdr_size(path: Path) -> tuple[int, int]:
    """Width and height in pixels, from the header alone; raises `BadInputError`."""
    return _Header(read_bytes(path, "Picture ", HEADER_BYTES), path).size


def read_hdr(path: Path) -> Picture:
    """Read the picture `path`: RGBE or XYZE, flat or run-length coded, lines in any of the eight orders.

    EXPOSURE and COLORCORR are divided out; colours come as linear Rec.709, which a file without PRIMARIES is taken for.

    Raises
    ------
    BadInputError
        The file is absent, damaged, cut off, or of another kind.
    """
    content = read_bytes(path, "Picture ")
    header = _Header(content[:HEADER_BYTES], path)
    lines = _lines(content, header, path)
    # color.h: the half is the middle of what the mantissa was cut from; an exponent of 0 is black.
    factor = np.where(lines[..., 3] > 0, np.ldexp(1.0, lines[..., 3].astype(int) - 136), 0.0)
    values = (lines[..., :3] + 0.5) * factor[..., None] / header.scale
    with np.errstate(over="ignore"):
        rgb = np.ascontiguousarray(_oriented(values, header), np.float32)
    if header.format == XYZE:
        rgb = to_rec709(rgb, XYZE_CHROMATICITIES, path) / np.float32(WHITE_EFFICACY)
    elif header.chromaticities is not None:
        rgb = to_rec709(rgb, header.chromaticities, path)
    return Picture(rgb, None)


def _oriented(lines: np.ndarray, header: _Header) -> np.ndarray:
    """(h, w, 3) with row 0 the top, from lines as stored: +Y runs up, +X runs right."""
    major, minor = header.signs
    if not header.rows_first:
        lines, (minor, major) = lines.swapaxes(0, 1), (major, minor)
    return lines[:: 1 if major == b"-" else -1, :: 1 if minor == b"+" else -1]


def _lines(content: bytes, header: _Header, path: Path) -> np.ndarray:
    """(major, minor, 4) uint8: what is stored, runs undone."""
    cut = f"Picture '{path}' is damaged or cut off; write or copy it again."
    count, width = header.major, header.minor
    data, at = memoryview(content), header.end
    if 4 * count * width <= len(content) - at and not _is_new(content, at, width) and not _has_runs(content, at):
        return np.frombuffer(content, np.uint8, 4 * count * width, at).reshape(count, width, 4)
    if count * width > MAX_RATIO * len(content):
        raise BadInputError(cut)
    lines = np.empty((count, width, 4), np.uint8)
    last = bytes(4)
    try:
        for line in lines:
            if _is_new(content, at, width):
                at = _new_line(data, at + 4, line)
            else:
                at = _old_line(content, at, line, last)
            last = line[-1].tobytes()
    except (IndexError, ValueError):
        raise BadInputError(cut) from None
    return lines


def _is_new(content: bytes, at: int, width: int) -> bool:
    """Whether the line at `at` is stored channel by channel."""
    return (
        RUNS[0] <= width <= RUNS[1]
        and content[at : at + 2] == b"\2\2"
        and at + 4 <= len(content)
        and content[at + 2] << 8 | content[at + 3] == width
    )


def _has_runs(content: bytes, at: int) -> bool:
    """Whether the pixels hold a mark of the old run-length code, which no colour needs: 1, 1, 1."""
    body = np.frombuffer(content, np.uint8, (len(content) - at) // 4 * 4, at).reshape(-1, 4)
    return bool((body[:, :3] == 1).all(1).any())


def _new_line(data: memoryview, at: int, line: np.ndarray) -> int:
    """Undo one line whose channels follow each other; gives the position behind it."""
    width = len(line)
    for channel in range(4):
        pieces = bytearray()
        while len(pieces) < width:
            count = data[at]
            if count > 128:
                pieces += bytes((data[at + 1],)) * (count - 128)
                at += 2
            else:
                if count == 0:
                    raise ValueError
                pieces += data[at + 1 : at + 1 + count]
                at += 1 + count
        if len(pieces) != width or at > len(data):
            raise ValueError
        line[:, channel] = np.frombuffer(pieces, np.uint8)
    return at


def _old_line(content: bytes, at: int, line: np.ndarray, last: bytes) -> int:
    """Undo one line of whole pixels, in which 1, 1, 1, n repeats the one before; gives the position behind it."""
    width, x, shift = len(line), 0, 0
    pixels = bytearray()
    while x < width:
        pixel = content[at : at + 4]
        if len(pixel) < 4:
            raise ValueError
        at += 4
        if pixel[:3] == b"\1\1\1":
            count = pixel[3] << shift
            shift += 8
            if x + count > width:
                raise ValueError
            pixels += last * count
            x += count
        else:
            pixels += pixel
            last, shift = pixel, 0
            x += 1
    line[:] = np.frombuffer(pixels, np.uint8).reshape(-1, 4)
    return at


def _numbers(text: bytes, count: int, path: Path) -> np.ndarray:
    numbers = [float_of(word) for word in text.split()]
    if len(numbers) != count or not all(math.isfinite(number) for number in numbers):
        raise BadInputError(f"Picture '{path}' has a damaged header; write or copy it again.")
    return np.array(numbers)
