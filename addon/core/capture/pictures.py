"""Pictures of every kind that a frame or mask may be stored in."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .exr import Picture, read_exr, read_header
from .png import png_size, read_png


def picture_size(path: Path) -> tuple[int, int]:
    """Width and height in pixels, from the header alone; finds a file that was cut off.

    Raises
    ------
    BadInputError
        The file is absent, damaged, or of a kind that isn't supported.
    """
    return read_header(path)


def mask_size(path: Path) -> tuple[int, int]:
    """As `picture_size`, for a mask."""
    return read_header(path) if path.suffix.lower() == ".exr" else png_size(path)


def read_picture(path: Path) -> Picture:
    """A frame's numbers, linear Rec.709.

    Raises
    ------
    BadInputError
        The file is absent, damaged, or of a kind that isn't supported.
    """
    return read_exr(path)


def read_mask(path: Path) -> np.ndarray:
    """(h, w) bool: False where the mask is black.

    Raises
    ------
    BadInputError
        As `read_picture`.
    """
    if path.suffix.lower() == ".exr":
        return (read_exr(path).rgb > 0).any(-1)
    pixels = read_png(path)
    return (pixels[..., : 1 if pixels.shape[2] < 3 else 3] > 0).any(-1)
