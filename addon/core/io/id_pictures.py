"""Pictures whose pixels are object ids."""

from pathlib import Path

import numpy as np

from ..errors import BadInputError
from ..kinds import Limit
from ..scene.model import Frame
from .camera_check import check_size
from .exr import read_numbers
from .exr_header import parse_headers
from .oiio import PNG, read_coded
from .pictures import EXR, picture_kind, picture_size

MAX_FRACTION: Limit[float] = 0.02
"""An id in a float channel is this near to a whole number; further off, pictures were blended or are no ids."""
MAX_EXACT = {2: 1 << 11, 4: 1 << 24, 8: 1 << 53}
"""Up to here floats of so many bytes hold every whole number."""


def check_ids(frame: Frame) -> None:
    """Compare the header of a frame's picture of ids with its camera; raises `BadInputError`."""
    assert frame.id_path is not None
    path, kind = frame.id_path, picture_kind(frame.id_path)
    if kind in (EXR, PNG):  # else told when it is read
        check_size(frame, path, parse_headers(path)[0].size if kind == EXR else picture_size(path))  # of any channel


def read_ids(frame: Frame) -> np.ndarray:
    """The ids of a frame's pixels, (height, width) int64.

    OpenEXR: a channel of whole numbers of any type, exact; of several, all alike. PNG: grey of 8 or 16 bits, or the
    number r + 256 g + 65536 b of colours (16 bits: with 65536 for 256).

    Raises
    ------
    BadInputError
        The picture can't be read, or holds no ids.
    """
    assert frame.id_path is not None
    path = frame.id_path
    if picture_kind(path) == EXR:
        return _whole_numbers(read_numbers(path), path)
    if picture_kind(path) != PNG:
        raise BadInputError(f"Picture '{path}' is no OpenEXR or PNG file; ids need one that loses nothing.")
    pixels = read_coded(path).colour
    step = np.iinfo(pixels.dtype).max + 1
    pixels = pixels.astype(np.int64)
    if (pixels == pixels[..., :1]).all():
        return pixels[..., 0]
    return pixels[..., 0] + step * pixels[..., 1] + step**2 * pixels[..., 2]


def _whole_numbers(stored: np.ndarray, path: Path) -> np.ndarray:
    """The ids in the channels ((h, w, c)) of an OpenEXR file."""
    values = stored[..., 0]
    if not np.isfinite(stored).all():
        raise BadInputError(f"Picture '{path}' has ids that are not finite; write whole numbers.")
    if not (stored == values[..., None]).all():
        raise BadInputError(
            f"Picture '{path}' has differing channels, which is no picture of ids; write the ids to one channel."
        )
    if values.dtype.kind != "f":
        return values.astype(np.int64)
    ids = np.rint(values.astype(np.float64))
    if np.abs(values - ids).max(initial=0) > MAX_FRACTION:
        raise BadInputError(
            f"Picture '{path}' has values between whole numbers, which are no ids; write it without filtering."
        )
    if np.abs(ids).max(initial=0) > MAX_EXACT[values.dtype.itemsize]:
        raise BadInputError(
            f"Picture '{path}' has ids above {MAX_EXACT[values.dtype.itemsize]}, which its floats can't "
            "hold; write them as whole numbers (uint), or number them from 0."
        )
    return ids.astype(np.int64)
