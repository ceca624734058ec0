"""DNG, a camera's raw picture, through rawpy (LibRaw), which is an extra: linear light, so no curve is estimated.

Colours are the camera's, made linear Rec.709 under daylight (D65) for all frames alike, not as each was balanced.
Source: Adobe, Digital Negative Specification 1.7.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..kinds import Code, Limit
from . import exif
from .files import read_bytes
from .oiio import Stored
from .picture import check_claim, decoding

DNG = "DNG"
DNG_VERSION: Code[int] = 50706
"""The tag that distinguishes a DNG from other TIFFs."""
HEAD_BYTES: Limit[int] = 1 << 16
"""Bytes within which the first directory has to end; the specification recommends to put it first."""
MAX_VALUE: Code[int] = 65535
"""LibRaw's greatest value, at which the sensor clips."""


def is_dng(path: Path) -> bool:
    """Whether a file that begins as a TIFF is a DNG."""
    try:
        return DNG_VERSION in exif.read_tags(read_bytes(path, "Picture ", HEAD_BYTES))
    except ValueError:  # of another order, or its directory lies behind the pixels
        return False


def raw_size(path: Path) -> tuple[int, int]:
    """Width and height as stored; raises `BadInputError` for a damaged or too large picture, or without rawpy."""
    with _open(path) as file:
        return int(file.sizes.width), int(file.sizes.height)


def read_raw(path: Path) -> Stored:
    """Read the DNG `path` as stored, not turned: 1 is where the sensor clips.

    Raises as `raw_size`, and where the pixels are damaged or cut off.
    """
    with _open(path) as file:
        import rawpy

        values = file.postprocess(
            gamma=(1, 1),
            no_auto_bright=True,
            use_camera_wb=False,
            use_auto_wb=False,
            output_bps=16,
            output_color=rawpy.ColorSpace.sRGB,
            user_flip=0,
        )
        if values.shape != (file.sizes.height, file.sizes.width, 3):
            raise ValueError("other pixels than its header says")
    return Stored(values.astype(np.float32) / np.float32(MAX_VALUE), None)


@contextmanager
def _open(path: Path) -> Iterator[Any]:
    try:
        import rawpy
    except ImportError as error:
        raise BadInputError(
            f"Picture '{path}' is DNG, which needs rawpy; install it (pip: rawpy) into this Python, or develop the "
            "pictures to linear OpenEXR or 16-bit TIFF."
        ) from error
    with decoding(path), rawpy.imread(str(path)) as file:
        width, height = file.sizes.width, file.sizes.height
        check_claim(path, width, height, 2 * width * height)
        yield file
