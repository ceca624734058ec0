"""What an OpenEXR file says of itself, read without the library.

The library is C++ and takes a header at its word: a file of 300 bytes may make it ask for gigabytes. So the header is
looked at here first: it is cheap (pre-flight reads only this), it tells a cut-off file from a whole one, and a file
that contradicts itself never reaches the library.
Layout: openexr.com/en/latest/OpenEXRFileLayout.html
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path

from ..errors import BadInputError

MAGIC = b"\x76\x2f\x31\x01"
MAX_PIXELS = 1 << 27
"""Largest picture that is read at all: 134 million pixels."""
MAX_RATIO = 5000
"""No compression of OpenEXR makes a picture smaller than this; more claims a size that the file can't hold."""
FREE_BYTES = 1 << 26
"""Below this many bytes of pixels the ratio is not looked at."""
HEADER_BYTES = (1 << 18, 1 << 24)
"""How much is read in search of the header's end, and how much where the first did not hold it."""
LINES_PER_CHUNK = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256, 10: 256, 11: 32}
TILED, LONG_NAMES, DEEP, MULTIPART = 0x200, 0x400, 0x800, 0x1000
PIXEL_BYTES = {0: 4, 1: 2, 2: 4}  # uint, half, float


@dataclass(frozen=True)
class ExrHeader:
    """The part of a header that matters here.

    Attributes
    ----------
    channels : dict of str to (int, int)
        Name to sampling in x and y.
    data_window, display_window : (xmin, ymin, xmax, ymax)
        Both ends belong to the window.
    chromaticities : tuple of 8 float, or None
        x and y of red, green, blue and white.
    """

    channels: dict[str, tuple[int, int]]
    data_window: tuple[int, int, int, int]
    display_window: tuple[int, int, int, int]
    chromaticities: tuple[float, ...] | None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the display window in pixels."""
        return window_size(self.display_window)


def window_size(window: tuple[int, int, int, int]) -> tuple[int, int]:
    """Width and height of a window in pixels."""
    return window[2] - window[0] + 1, window[3] - window[1] + 1


class _Damaged(Exception):
    """The header contradicts itself; the text says how, as the second half of a sentence."""


def parse_header(path: Path) -> ExrHeader:
    """Read and check the header and the table of chunks of the OpenEXR file `path`.

    Raises
    ------
    BadInputError
        Absent, not a file, not OpenEXR, damaged, cut off, or of a kind that isn't supported (deep, several parts).
    """
    path = Path(path)
    try:
        # A pipe or a device would block or never end.
        if not path.is_file():
            what = "is not a file" if path.exists() else "does not exist"
            raise BadInputError(f"Picture '{path}' {what}; check the capture's paths.")
        size = path.stat().st_size
        with open(path, "rb") as file:
            for limit in HEADER_BYTES:
                file.seek(0)
                head = file.read(limit)
                try:
                    header, end, chunk_count, chunk_head = _parse(head, size)
                    break
                except (IndexError, struct.error):
                    if len(head) == size or limit == HEADER_BYTES[-1]:
                        raise _Damaged("ends within its header") from None
            _check_chunks(file, end, chunk_count, chunk_head, size)
        return header
    except _Damaged as error:
        raise BadInputError(f"Picture '{path}' {error}; write or copy it again.") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise BadInputError(f"Picture '{path}' can't be read ({reason}); check the file and its rights.") from error


def _parse(head: bytes, size: int) -> tuple[ExrHeader, int, int | None, int]:
    """Parse `head`; also gives where it ends, how many chunks follow (None: unknown), and a chunk's head in bytes.

    Running off the end of `head` raises IndexError or struct.error.
    """
    if not head:
        raise _Damaged("is empty")
    if head[:4] != MAGIC:
        raise _Damaged("is not an OpenEXR file, the only kind of frame that holds radiance")
    (flags,) = struct.unpack_from("<I", head, 4)
    if flags & 0xFF != 2 or flags & ~(0xFF | TILED | LONG_NAMES | DEEP | MULTIPART):
        raise _Damaged("is of an unknown version of OpenEXR")
    if flags & DEEP or flags & MULTIPART:
        kind = "deep pixels" if flags & DEEP else "several parts"
        raise _Damaged(f"holds {kind}, which isn't supported")

    attributes, at = _attributes(head)
    windows = []
    for name in ("dataWindow", "displayWindow"):
        if len(attributes.get(name, b"")) != 16:
            raise _Damaged(f"has no {name}")
        window = struct.unpack("<4i", attributes[name])
        width, height = window_size(window)
        if width < 1 or height < 1 or width * height > MAX_PIXELS:
            raise _Damaged(f"claims a {name} of {width} x {height} pixels")
        windows.append(window)
    channels, pixel_bytes = _channels(attributes.get("channels", b""))

    width, height = window_size(windows[0])
    if width * height * pixel_bytes > max(FREE_BYTES, MAX_RATIO * size):
        raise _Damaged(f"claims {width} x {height} pixels, more than its {size} bytes can hold")
    if len(attributes.get("compression", b"")) != 1:
        raise _Damaged("does not name its compression")
    if flags & TILED:
        tiles = attributes.get("tiles", b"")
        if len(tiles) != 9:
            raise _Damaged("does not give the size of its tiles")
        x, y, mode = struct.unpack("<IIB", tiles)
        if not (0 < x <= 1 << 16 and 0 < y <= 1 << 16) or x * y * pixel_bytes > 1 << 30:
            raise _Damaged(f"claims tiles of {x} x {y} pixels")
        # Further levels of a mip-map follow the first one in the table; nothing here needs their number.
        chunk_count = math.ceil(width / x) * math.ceil(height / y) if mode & 0xF == 0 else None
        chunk_head = 20
    else:
        lines = LINES_PER_CHUNK.get(attributes["compression"][0])
        chunk_count = math.ceil(height / lines) if lines else None
        chunk_head = 8
    chroma = attributes.get("chromaticities")
    if chroma is not None and len(chroma) != 32:
        raise _Damaged("has a damaged attribute 'chromaticities'")
    header = ExrHeader(channels, *windows, struct.unpack("<8f", chroma) if chroma else None)
    return header, at, chunk_count, chunk_head


def _attributes(head: bytes) -> tuple[dict[str, bytes], int]:
    """The header's attributes by name, and the position behind them."""
    found: dict[str, bytes] = {}
    at = 8
    while head[at]:
        name, at = _text(head, at)
        _, at = _text(head, at)
        (length,) = struct.unpack_from("<i", head, at)
        at += 4
        if length < 0:
            raise _Damaged("has a damaged header")
        if at + length > len(head):
            raise IndexError
        found.setdefault(name, head[at : at + length])
        at += length
    return found, at + 1


def _text(data: bytes, at: int) -> tuple[str, int]:
    """A NUL-ended name and the position behind it."""
    end = data.find(b"\0", at, at + 256)
    if end < 0:
        if at + 256 > len(data):
            raise IndexError
        raise _Damaged("has a damaged header")
    return data[at:end].decode("latin-1"), end + 1


def _channels(data: bytes) -> tuple[dict[str, tuple[int, int]], int]:
    """The sampling of each channel, and the bytes of one pixel."""
    channels: dict[str, tuple[int, int]] = {}
    pixel_bytes = at = 0
    try:
        while data[at]:
            name, at = _text(data, at)
            kind, _, x, y = struct.unpack_from("<iIii", data, at)
            at += 16
            if kind not in PIXEL_BYTES or x < 1 or y < 1:
                raise _Damaged("has a damaged list of channels")
            channels[name] = (x, y)
            pixel_bytes += PIXEL_BYTES[kind]
    except (IndexError, struct.error):
        raise _Damaged("has a damaged list of channels") from None
    if not channels:
        raise _Damaged("has no channels")
    return channels, pixel_bytes


def _check_chunks(file, table: int, count: int | None, chunk_head: int, size: int) -> None:
    """Compare the table of chunks, which follows the header, with the file's size: so a cut-off file is found."""
    if count is None:
        return
    if table + count * (8 + chunk_head) > size:
        raise _Damaged("is cut off")
    file.seek(table)
    offsets = struct.unpack(f"<{count}Q", file.read(8 * count))
    if min(offsets) < table + 8 * count or max(offsets) + chunk_head > size:
        raise _Damaged("is cut off or was never finished")
    file.seek(max(offsets) + chunk_head - 4)
    (length,) = struct.unpack("<i", file.read(4))
    if length < 0 or max(offsets) + chunk_head + length > size:
        raise _Damaged("is cut off")
