"""The colours that an ICC profile names: iPhones write Display P3, which is read as Rec.709 a tenth too pale.

Only the primaries are taken: the curve is what `--transfer` says, or is estimated.
Source: ICC.1:2022, 7.2 (header), 7.3 (tag table), 9.2 (redMatrixColumnTag and its like), 10.31 (XYZType).
"""

from __future__ import annotations

import struct

import numpy as np

from ..kinds import Code, Limit

HEADER: Code[int] = 128
REC709_D50 = np.array([[0.43607, 0.38515, 0.14307], [0.22249, 0.71687, 0.06061], [0.01392, 0.09708, 0.71410]])
"""Linear Rec.709 to CIE XYZ under D50, which profiles refer to; the columns of sRGB's own profile (IEC 61966-2-1)."""
SAME: Limit[float] = 5e-3
"""Difference of coefficients up to which a profile is taken for sRGB's: their writers round."""
MAX_GAIN: Limit[float] = 10.0
"""No primaries of cameras or displays are farther from Rec.709's."""


def to_rec709(profile: bytes) -> np.ndarray | None:
    """(3, 3) float32 from linear RGB of `profile` to Rec.709; None where they are the same or it doesn't tell."""
    try:
        columns = np.stack([_column(profile, name) for name in (b"rXYZ", b"gXYZ", b"bXYZ")], 1)
    except (ValueError, struct.error):
        return None
    matrix = np.linalg.solve(REC709_D50, columns)
    if np.abs(matrix).max() > MAX_GAIN or np.allclose(matrix, np.eye(3), atol=SAME):
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
