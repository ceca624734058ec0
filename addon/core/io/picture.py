"""A picture in memory, of whatever kind its file was."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import BadInputError, ScanRelightError
from ..kinds import Limit

MAX_PIXELS: Limit[int] = 1 << 26
"""Largest picture that is read at all: 67 million pixels, above the 48 of phones."""


MIN_BYTES: Limit[float] = 1 / 64
"""Minimum bytes per pixel in a camera's picture file: sensor noise compresses no further."""
FREE_PIXELS: Limit[int] = 1 << 22
"""Up to so many pixels a picture may take fewer bytes: it costs little memory, whatever its header claims."""
LARGE: Limit[tuple[int, int]] = (1 << 28, 400)
"""Bytes of pixels that any file may hold, and the ratio of pixel bytes to file bytes allowed beyond that."""


def too_large(stored: int, size: int) -> bool:
    """Whether `stored` bytes of pixels are implausible for a file of `size` bytes."""
    return stored > max(LARGE[0], LARGE[1] * size)


def check_claim(path: Path, width: int, height: int, stored: int, max_stored: float = math.inf) -> None:
    """Raise `BadInputError` where a picture's header claims too much, before room for any pixel is made.

    Parameters
    ----------
    stored : int
        Bytes that its pixels take.
    max_stored : float
        Bytes of pixels that a file of this format can hold, where known.
    """
    if not 0 < width * height <= MAX_PIXELS or stored > max_stored or too_large(stored, path.stat().st_size):
        raise BadInputError(
            f"Picture '{path}' claims {width} x {height} pixels, more than it can hold; write or copy it again."
        )


@contextmanager
def decoding(path: Path, what: str = "Picture") -> Iterator[None]:
    """Turn any error of a library that reads the picture (`what`) `path` into a `BadInputError`, one sentence long."""
    try:
        yield
    except ScanRelightError:
        raise
    except Exception as error:
        raise BadInputError(f"{what} '{path}' is damaged or cut off; write or copy it again.") from error


def too_few_bytes(width: int, height: int, size: int) -> bool:
    """Whether a file of `size` bytes is too small for a camera's picture of this size: a decompression bomb."""
    return width * height > max(FREE_PIXELS, size / MIN_BYTES)


def turn(pixels: np.ndarray, orientation: int) -> np.ndarray:
    """Stored pixels, (h, w, ...), as EXIF's `orientation` (1 to 8; others are taken as 1) shows them; a view.

    Source: CIPA DC-008 (Exif 2.32), 4.6.4.A.
    """
    if orientation > 4:
        pixels = pixels.swapaxes(0, 1)
    row_step, column_step = signs(orientation)
    return pixels[::row_step, ::column_step]


def signs(orientation: int) -> tuple[int, int]:
    """Steps (1, or -1: reversed) along rows and columns in EXIF's `orientation`; from 5 on after transposition."""
    return {1: (1, 1), 2: (1, -1), 3: (-1, -1), 0: (-1, 1)}[orientation % 4] if 1 <= orientation <= 8 else (1, 1)


class Picture(NamedTuple):
    """A picture, row 0 at the top.

    Attributes
    ----------
    rgb : (h, w, 3) float32
        Linear; NaN where the display window is larger than the data.
    alpha : (h, w) float32 or None
    to_rec709 : (3, 3) float32 or None
        Matrix to linear Rec.709 that is still to be applied to decoded codes; None: they are Rec.709.
    """

    rgb: np.ndarray
    alpha: np.ndarray | None
    to_rec709: np.ndarray | None = None
