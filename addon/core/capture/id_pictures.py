"""Pictures whose pixels are object ids."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import BadInputError
from .exr import read_exr
from .model import Frame
from .png import read_png

OFF = 0.02
"""An id in a float channel is this near to a whole number; further off, pictures were blended or are no ids."""
EXACT = 1 << 24
"""From here on float32 leaves out whole numbers."""


def read_ids(frame: Frame) -> np.ndarray:
    """The ids of a frame's pixels, (height, width) int64.

    OpenEXR: a channel of whole numbers; of RGB, all three alike. PNG: grey, or the number r + 256 g + 65536 b.

    Raises
    ------
    BadInputError
        The picture can't be read, or holds no ids.
    """
    path = Path(frame.id_path)
    if path.suffix.lower() == ".exr":
        return _whole(read_exr(path).rgb, path)
    pixels = read_png(path)
    pixels = pixels.reshape(*pixels.shape[:2], -1).astype(np.int64)
    if pixels.shape[2] < 3 or ((pixels[..., 0] == pixels[..., 1]) & (pixels[..., 0] == pixels[..., 2])).all():
        return pixels[..., 0]
    return pixels[..., 0] + 256 * pixels[..., 1] + 65536 * pixels[..., 2]


def _whole(rgb: np.ndarray, path: Path) -> np.ndarray:
    values = rgb[..., 0]
    if not np.isfinite(rgb).all():
        raise BadInputError(f"Picture '{path}' has ids that are not finite; write whole numbers.")
    if not (rgb == values[..., None]).all():
        raise BadInputError(f"Picture '{path}' has differing channels, which is no picture of ids; write the ids to "
                            "one channel.")
    ids = np.rint(values.astype(np.float64))
    if np.abs(values - ids).max(initial=0) > OFF:
        raise BadInputError(f"Picture '{path}' has values between whole numbers, which are no ids; write it without "
                            "filtering.")
    if np.abs(ids).max(initial=0) >= EXACT:
        raise BadInputError(f"Picture '{path}' has ids from {EXACT} on, which a float can't hold; number them from 0.")
    return ids.astype(np.int64)
