"""The colours that an ICC profile names: iPhones write Display P3, which is read as Rec.709 a tenth too pale.

Only the primaries are taken: the curve is what `--transfer` says, or is estimated.
Source: ICC.1:2022, 7.2 (header), 7.3 (tag table), 9.2 (redMatrixColumnTag and its like), 10.31 (XYZType).
"""

import struct

import numpy as np

from ..kinds import Code, Limit
from .primaries import xyz_to_rec709

HEADER: Code[int] = 128
SAME: Limit[float] = 5e-3
"""Difference of coefficients up to which a profile is taken for sRGB's: their writers round."""
FARTHEST: Limit[float] = 10.0
"""No primaries of cameras or displays are farther from Rec.709's."""


def profile_to_rec709(profile: bytes) -> np.ndarray | None:
    """(3, 3) float32 from linear RGB of `profile` to Rec.709; None where they are the same or it doesn't tell."""
    try:
        columns = np.stack([_column(profile, name) for name in (b"rXYZ", b"gXYZ", b"bXYZ")], 1)
    except (ValueError, struct.error):
        return None
    if np.linalg.matrix_rank(columns) < 3:  # they span no colours
        return None
    with np.errstate(all="ignore"):
        matrix = xyz_to_rec709(columns)
    if not np.abs(matrix).max() <= FARTHEST or np.allclose(matrix, np.eye(3), atol=SAME):
        return None
    return matrix.astype(np.float32)


def _column(profile: bytes, name: bytes) -> np.ndarray:
    """A primary's X, Y, Z. Raises ValueError where there is none, struct.error where the profile is cut off."""
    (count,) = struct.unpack_from(">I", profile, HEADER)
    for k in range(min(count, len(profile) // 12)):
        signature, offset, _ = struct.unpack_from(">4sII", profile, HEADER + 4 + 12 * k)
        if signature == name:
            kind, *xyz = struct.unpack_from(">4s4x3i", profile, offset)
            if kind == b"XYZ ":
                return np.array(xyz) / 65536
    raise ValueError("no such tag")
