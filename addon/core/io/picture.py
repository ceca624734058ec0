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
"""Bytes that a pixel of a camera's picture takes in its file at least: the noise of a sensor compresses no further."""
FREE_PIXELS: Limit[int] = 1 << 22
"""A picture of so many pixels may take fewer: it costs little, whatever it claims."""
LARGE: Limit[tuple[int, int]] = (1 << 28, 400)
"""Bytes of pixels beyond which a file has to hold one for so many of them, whatever its pixels are."""


def too_large(stored: int, size: int) -> bool:
    """Whether so many bytes of pixels (`stored`) are out of all proportion to a file of `size` bytes."""
    return stored > max(LARGE[0], LARGE[1] * size)


def check_claim(path: Path, width: int, height: int, stored: int, max_stored: float = math.inf) -> None:
    """Raise `BadInputError` where a picture's header claims too much, before room for any pixel is made.

    Parameters
    ----------
    stored : int
        Bytes that its pixels take.
    max_stored : float
        Bytes of pixels that such a file can hold, where its format tells.
    """
    if not 0 < width * height <= MAX_PIXELS or stored > max_stored or too_large(stored, path.stat().st_size):
        raise BadInputError(
            f"Picture '{path}' claims {width} x {height} pixels, more than it can hold; write or copy it again."
        )


@contextmanager
def decoding(path: Path, what: str = "Picture") -> Iterator[None]:
    """Turn whatever a library raises at the picture (`what`) `path` into one sentence, a `BadInputError`."""
    try:
        yield
    except ScanRelightError:
        raise
    except Exception as error:
        raise BadInputError(f"{what} '{path}' is damaged or cut off; write or copy it again.") from error


def too_few_bytes(width: int, height: int, size: int) -> bool:
    """Whether a camera's picture of so many pixels can't be in a file of `size` bytes: it was made to fill memory."""
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
    """Whether rows and columns run backwards (-1) in EXIF's `orientation`; from 5 on once they changed places."""
    return {1: (1, 1), 2: (1, -1), 3: (-1, -1), 0: (-1, 1)}[orientation % 4] if 1 <= orientation <= 8 else (1, 1)


class Picture(NamedTuple):
    """A picture, row 0 at the top.

    Attributes
    ----------
    rgb : (h, w, 3) float32
        Linear; NaN where the display window is larger than the data.
    alpha : (h, w) float32 or None
    to_rec709 : (3, 3) float32 or None
        What the pixels of codes are still to be multiplied by once they are linear; None: they are Rec.709.
    """

    rgb: np.ndarray
    alpha: np.ndarray | None
    to_rec709: np.ndarray | None = None
