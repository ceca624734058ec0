"""Pictures that need a decoder which the core has not: JPEG and TIFF. Their headers are read here.

Their pixels are read by whatever the caller brings (Blender), once, into files that the core can read: `converted`.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from ..errors import BadInputError, StorageError
from ..progress import Progress
from .exr import write_exr
from .model import Capture, Frame
from .picture import MAX_PIXELS
from .png import write_png
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
        return exposure_tags(data)
    at = data.find(b"Exif\0\0")
    return exposure_tags(data[at + 6 :]) if at >= 0 else {}


def converted(capture: Capture, folder: Path, load: Callable[[Path], np.ndarray], progress: Progress) -> Capture:
    """The capture with its foreign pictures replaced by copies in `folder` that the core can read.

    A copy that is there already, of a picture that has not changed since, is taken as it is.

    Parameters
    ----------
    load : callable
        Gives a picture's codes, (h, w, 3) uint8 with row 0 the top, or its linear values, float32. Called from this
        thread alone.

    Raises
    ------
    BadInputError
        A picture can't be decoded.
    StorageError
        The folder can't be written.
    InterruptedRun
    """
    todo = {path for frame in capture.frames for path in _paths(frame) if _foreign(path)}
    copies: dict[Path, Path] = {}
    for i, path in enumerate(sorted(todo)):
        copies[path] = _copy(path, folder, load)
        progress.update((i + 1) / len(todo))
    if not copies:
        return capture
    return replace(capture, frames=tuple(_moved(frame, copies) for frame in capture.frames))


def _copy(path: Path, folder: Path, load: Callable[[Path], np.ndarray]) -> Path:
    """Make the copy of `path`, of the same time, unless it is there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        stat = path.stat()
        unique = sha256(f"{path.absolute()} {stat.st_size} {stat.st_mtime_ns}".encode("utf-8", "surrogatepass"))
        ending = ".png" if foreign_info(path)[2] == 8 else ".exr"
        target = folder / f"{path.stem[:80]}-{unique.hexdigest()[:12]}{ending}"
        if not target.is_file():
            pixels = load(path)
            if ending == ".png":
                write_png(target, pixels, level=1)
            else:
                write_exr(target, pixels)
            os.utime(target, ns=(stat.st_mtime_ns, stat.st_mtime_ns))  # stages know a picture by its time
    except OSError as error:
        raise StorageError(f"'{folder}' can't be written ({error.strerror or error}); free some space or choose "
                           "another result folder.") from error
    return target


def _paths(frame: Frame) -> list[Path]:
    more = [path for path in (frame.mask_path, frame.id_path) if path is not None]
    return [frame.path, *more, *(shot.path for shot in frame.brackets)]


def _moved(frame: Frame, copies: dict[Path, Path]) -> Frame:
    def moved(path):
        return copies.get(path, path)

    return replace(frame, path=moved(frame.path), mask_path=moved(frame.mask_path), id_path=moved(frame.id_path),
                   brackets=tuple(replace(shot, path=moved(shot.path)) for shot in frame.brackets))


def _foreign(path: Path) -> bool:
    try:
        with open(path, "rb") as file:
            return is_foreign(file.read(4))
    except OSError as error:
        raise BadInputError(f"'{path}' was taken away during the run; put it back and start anew.") from error


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


def _tiff_info(data: bytes, path: Path) -> tuple[int, int, int]:
    if int.from_bytes(data[4:8], "little" if data.startswith(b"II") else "big") >= HEAD:
        with open(path, "rb") as file:  # the directory often follows the pixels
            data = file.read(1 << 30)
    tags = read_tags(data)
    bits = int(tags.get(BITS, 1))
    is_float = tags.get(SAMPLE_FORMAT) == FLOAT
    if bits not in ((16, 32) if is_float else (8, 16)):
        raise BadInputError(f"Picture '{path}' is a TIFF of {bits} bits, which isn't supported; write PNG or EXR.")
    return int(tags.get(WIDTH, 0)), int(tags.get(HEIGHT, 0)), 0 if is_float else bits
