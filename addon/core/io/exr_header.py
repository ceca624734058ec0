"""What an OpenEXR file says of itself, read without the library.

The library is C++ and takes a header at its word: a file of 300 bytes may make it ask for gigabytes. So the header is
looked at here first: it is cheap (pre-flight reads only this), it tells a cut-off file from a whole one, and a file
that contradicts itself never reaches the library.
Layout: openexr.com/en/latest/OpenEXRFileLayout.html
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ..errors import BadInputError
from ..kinds import Code, Limit
from .files import check_picture, readable
from .picture import MAX_PIXELS, too_large

MAGIC = b"\x76\x2f\x31\x01"
MAX_PARTS: Limit[int] = 1024
MAX_RATIO: Limit[int] = 5000
"""No compression of OpenEXR makes a picture smaller than this; more claims a size that the file can't hold."""
FREE_BYTES: Limit[int] = 1 << 26
"""Below this many bytes of pixels the ratio is not looked at."""
MAX_BYTES: Limit[int] = 1 << 31
"""Of the pixels of all channels and parts: the library decodes every one of them, whichever is asked for."""
HEADER_BYTES: Limit[tuple[int, int]] = (1 << 18, 1 << 24)
"""How much is read in search of the header's end, and how much where the first did not hold it."""
LINES_PER_CHUNK = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256, 10: 256, 11: 32, 12: 256, 13: 1}
TILED: Code[int] = 0x200
LONG_NAMES: Code[int] = 0x400
DEEP: Code[int] = 0x800
MULTIPART: Code[int] = 0x1000
PIXEL_BYTES = {0: 4, 1: 2, 2: 4}  # uint, half, float


@dataclass(frozen=True)
class ExrHeader:
    """What matters here of the header of a part; most files have one.

    Attributes
    ----------
    channels : dict of str to (int, int)
        Name to sampling in x and y.
    data_window, display_window : (xmin, ymin, xmax, ymax)
        Both ends belong to the window.
    chromaticities : tuple of 8 float, or None
        x and y of red, green, blue and white.
    name : str
        Of the part; '' in a file of one.
    view : str
        Which eye's view the part is; '' where it does not say.
    views : tuple of str
        Views that lie side by side in the channels, the default first.
    """

    channels: dict[str, tuple[int, int]]
    data_window: tuple[int, int, int, int]
    display_window: tuple[int, int, int, int]
    chromaticities: tuple[float, ...] | None
    name: str = ""
    view: str = ""
    views: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the display window in pixels."""
        return window_size(self.display_window)


def window_size(window: tuple[int, int, int, int]) -> tuple[int, int]:
    """Width and height of a window in pixels."""
    return window[2] - window[0] + 1, window[3] - window[1] + 1


class _Damaged(Exception):
    """The header contradicts itself; the text says how, as the second half of a sentence."""


@dataclass(frozen=True)
class _Chunks:
    """How many chunks a part has, how many of them (the first) its largest level, and the bytes each has before its
    pixels; the last four of those are the pixels' number.
    """

    count: int
    largest: int
    head: int


def parse_headers(path: Path) -> tuple[ExrHeader, ...]:
    """Read and check the headers of all parts and the tables of chunks of the OpenEXR file `path`.

    Raises `BadInputError` where it is absent, not a file, not OpenEXR, damaged, cut off, or deep.
    """
    try:
        check_picture(path)
        with readable(f"Picture '{path}'"), open(path, "rb") as file:
            size = path.stat().st_size
            for limit in HEADER_BYTES:
                file.seek(0)
                head = file.read(limit)
                try:
                    headers, at, chunks = _parse(head, size)
                    break
                except (IndexError, struct.error):
                    if len(head) == size or limit == HEADER_BYTES[-1]:
                        raise _Damaged("ends within its header") from None
            end = at + 8 * sum(part.count for part in chunks)
            for part in chunks:
                _check_chunks(file, at, part, end, size)
                at += 8 * part.count
        return headers
    except _Damaged as error:
        raise BadInputError(f"Picture '{path}' {error}; write or copy it again.") from error


def _parse(head: bytes, size: int) -> tuple[tuple[ExrHeader, ...], int, list[_Chunks]]:
    """Parse `head`; also gives where it ends and what follows for each part.

    Running off the end of `head` raises IndexError or struct.error.
    """
    if not head:
        raise _Damaged("is empty")
    if head[:4] != MAGIC:
        raise _Damaged("is not an OpenEXR file")
    (flags,) = struct.unpack_from("<I", head, 4)
    if flags & 0xFF != 2 or flags & ~(0xFF | TILED | LONG_NAMES | DEEP | MULTIPART):
        raise _Damaged("is of an unknown version of OpenEXR")
    parts = []
    attributes, at = _attributes(head, 8)
    parts.append(attributes)
    while flags & MULTIPART and head[at]:
        attributes, at = _attributes(head, at)
        parts.append(attributes)
        if len(parts) > MAX_PARTS:
            raise _Damaged(f"has over {MAX_PARTS} parts")
    at += bool(flags & MULTIPART)
    if flags & DEEP or any(part.get("type", b"").startswith(b"deep") for part in parts):
        raise _Damaged("holds deep pixels, which have no one colour; flatten it")
    headers, chunks, bytes_in_all = [], [], 0
    for part in parts:
        header, pixel_bytes = _part(part)
        width, height = window_size(header.data_window)
        bytes_in_all += width * height * pixel_bytes
        if bytes_in_all > max(FREE_BYTES, MAX_RATIO * size) or too_large(bytes_in_all, size):
            raise _Damaged(f"claims {width} x {height} pixels, more than its {size} bytes can hold")
        if bytes_in_all > MAX_BYTES:
            raise _Damaged(f"holds over {MAX_BYTES >> 30} GiB of pixels in all its channels, more than is read")
        headers.append(header)
        tiled = flags & TILED if not flags & MULTIPART else part.get("type", b"").startswith(b"tiled")
        largest, count = _tile_count(part, width, height, pixel_bytes) if tiled else _strip_count(part, height)
        if flags & MULTIPART and part.get("chunkCount") != struct.pack("<i", count):
            raise _Damaged("has a damaged chunkCount")
        chunks.append(_Chunks(count, largest, (20 if tiled else 8) + (4 if flags & MULTIPART else 0)))
    return tuple(headers), at, chunks


def _part(attributes: dict[str, bytes]) -> tuple[ExrHeader, int]:
    """The header that `attributes` make up, and the bytes of a pixel."""
    windows: list[tuple[int, int, int, int]] = []
    for name in ("dataWindow", "displayWindow"):
        if len(attributes.get(name, b"")) != 16:
            raise _Damaged(f"has no {name}")
        window = struct.unpack("<4i", attributes[name])
        width, height = window_size(window)
        if width < 1 or height < 1 or width * height > MAX_PIXELS:
            raise _Damaged(f"claims a {name} of {width} x {height} pixels")
        windows.append(window)
    channels, pixel_bytes = _channels(attributes.get("channels", b""))
    if len(attributes.get("compression", b"")) != 1:
        raise _Damaged("does not name its compression")
    chroma = attributes.get("chromaticities")
    if chroma is not None and len(chroma) != 32:
        raise _Damaged("has a damaged attribute 'chromaticities'")
    name, view = (attributes.get(key, b"").decode("latin-1") for key in ("name", "view"))
    views = _strings(attributes.get("multiView", b""))
    chromaticities = struct.unpack("<8f", chroma) if chroma else None
    data, display = windows
    return ExrHeader(channels, data, display, chromaticities, name, view, views), pixel_bytes


def _strip_count(attributes: dict[str, bytes], height: int) -> tuple[int, int]:
    lines = LINES_PER_CHUNK.get(attributes["compression"][0])
    if lines is None:
        raise _Damaged(f"has the compression {attributes['compression'][0]}, which isn't known")
    return (math.ceil(height / lines),) * 2


def _tile_count(attributes: dict[str, bytes], width: int, height: int, pixel_bytes: int) -> tuple[int, int]:
    """Tiles of the largest level, and of all: one, those of a mip-map, or those of a rip-map."""
    tiles = attributes.get("tiles", b"")
    if len(tiles) != 9:
        raise _Damaged("does not give the size of its tiles")
    x, y, mode = struct.unpack("<IIB", tiles)
    if not (0 < x <= 1 << 16 and 0 < y <= 1 << 16) or x * y * pixel_bytes > 1 << 30:
        raise _Damaged(f"claims tiles of {x} x {y} pixels")
    levels, up = mode & 0xF, mode >> 4
    if levels > 2 or up > 1:
        raise _Damaged("has unknown levels of tiles")
    across = [math.ceil(n / x) for n in _level_sizes(width, up)]
    down = [math.ceil(n / y) for n in _level_sizes(height, up)]
    largest = across[0] * down[0]
    if levels == 0:
        return largest, largest
    if levels == 2:
        return largest, sum(across) * sum(down)
    count = max(len(across), len(down))
    across += across[-1:] * (count - len(across))
    down += down[-1:] * (count - len(down))
    return largest, sum(a * b for a, b in zip(across, down))


def _level_sizes(size: int, up: int) -> list[int]:
    """`size` halved until it is 1, rounded down or `up`."""
    sizes = [size]
    while sizes[-1] > 1:
        sizes.append((sizes[-1] + up) // 2)
    return sizes


def _strings(data: bytes) -> tuple[str, ...]:
    """A vector of strings, each with its length before it."""
    strings, at = [], 0
    while at + 4 <= len(data):
        (length,) = struct.unpack_from("<i", data, at)
        if length < 0 or at + 4 + length > len(data):
            raise _Damaged("has a damaged attribute 'multiView'")
        strings.append(data[at + 4 : at + 4 + length].decode("latin-1"))
        at += 4 + length
    return tuple(strings)


def _attributes(head: bytes, at: int) -> tuple[dict[str, bytes], int]:
    """The attributes by name of the header at `at`, and the position behind them."""
    attributes: dict[str, bytes] = {}
    while head[at]:
        name, at = _text(head, at)
        _, at = _text(head, at)
        (length,) = struct.unpack_from("<i", head, at)
        at += 4
        if length < 0:
            raise _Damaged("has a damaged header")
        if at + length > len(head):
            raise IndexError
        attributes.setdefault(name, head[at : at + length])
        at += length
    return attributes, at + 1


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


def _check_chunks(file: BinaryIO, table: int, part: _Chunks, end: int, size: int) -> None:
    """Compare the table of a part's chunks with the file's size, so that a cut-off file is found.

    `end` is where all tables end.
    """
    if end + part.count * part.head > size:
        raise _Damaged("is cut off")
    file.seek(table)
    offsets = struct.unpack(f"<{part.largest}Q", file.read(8 * part.largest))
    if min(offsets) < end or max(offsets) + part.head > size:
        raise _Damaged("is cut off or was never finished")
    file.seek(max(offsets) + part.head - 4)
    (length,) = struct.unpack("<i", file.read(4))
    if length < 0 or max(offsets) + part.head + length > size:
        raise _Damaged("is cut off")
