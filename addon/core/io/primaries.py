"""From a picture's own primaries to linear Rec.709, and from luminance and chroma to its primaries.

Source: SMPTE RP 177 (primaries and white to XYZ); K. M. Lam's linear Bradford transform (white to white), as ICC.1:2022
Annex E gives it. Luminance and chroma as OpenEXR stores them: openexr.com, "Technical Introduction"; `ImfRgbaYca`.
Profiles: ICC.1:2022, 7.2 (header), 7.3 (tag table), 9.2 (redMatrixColumnTag and its like), 10.31 (XYZType).
"""

import struct

import numpy as np

from ..errors import BadInputError
from ..kinds import Code, Limit

REC709: Code[tuple[float, ...]] = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""x and y of red, green, blue and white; what a file without chromaticities means."""
CIE_XYZ: Code[tuple[float, ...]] = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)
"""Primaries of pictures that hold X, Y and Z: their white is a unit, not what the picture's maker adapted to."""
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
MAX_GAIN: Limit[int] = 5000
"""Primaries that need a greater factor span no colours."""
PROFILE_HEADER: Code[int] = 128
SAME: Limit[float] = 5e-3
"""Difference of coefficients up to which a profile is taken for sRGB's: their writers round."""
FARTHEST: Limit[float] = 10.0
"""No primaries of cameras or displays are farther from Rec.709's."""
TAPS = np.array([0.002128, -0.007540, 0.019597, -0.043159, 0.087929, -0.186077, 0.627123])
"""Weights of the stored samples at the distances 13, 11, ... 1 from a pixel between two of them, on each side."""


def rgb_to_xyz(chromaticities: tuple[float, ...]) -> np.ndarray:
    """(3, 3) matrix from RGB of these primaries to CIE XYZ with Y = 1 at white."""
    x, y = np.array(chromaticities, float).reshape(4, 2).T
    xyz = np.stack([x, y, 1 - x - y])
    xyz[:, 3] /= y[3]
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])


def xyz_to_rec709(to_xyz: np.ndarray) -> np.ndarray:
    """(3, 3) matrix to linear Rec.709 from RGB that `to_xyz` ((3, 3)) takes to XYZ; white becomes white (Bradford)."""
    wanted = rgb_to_xyz(REC709)
    gain = (BRADFORD @ wanted.sum(1)) / (BRADFORD @ to_xyz.sum(1))
    return np.linalg.solve(wanted, np.linalg.solve(BRADFORD, gain[:, None] * BRADFORD) @ to_xyz)


def to_rec709(rgb: np.ndarray, chromaticities: tuple[float, ...], name: object) -> np.ndarray:
    """Convert linear `rgb` ((h, w, 3) float32) from `chromaticities`; white becomes white (Bradford).

    Raises `BadInputError` where the primaries span no colours; `name` is the file.
    """
    if np.allclose(chromaticities, REC709, atol=1e-3):
        return rgb
    try:
        with np.errstate(all="raise"):
            to_xyz = rgb_to_xyz(chromaticities)
            is_xyz = np.allclose(chromaticities[:6], CIE_XYZ, atol=1e-3)
            matrix = np.linalg.solve(rgb_to_xyz(REC709), to_xyz) if is_xyz else xyz_to_rec709(to_xyz)
    except (ArithmeticError, np.linalg.LinAlgError):
        matrix = np.full((3, 3), np.nan)
    if not np.all(np.abs(matrix) < MAX_GAIN):
        raise BadInputError(f"Picture '{name}' names primaries that span no colours; write it in linear Rec.709.")
    with np.errstate(all="ignore"):
        return rgb @ matrix.T.astype(np.float32)


def profile_to_rec709(profile: bytes) -> np.ndarray | None:
    """(3, 3) float32 from linear RGB of an ICC `profile` to Rec.709; None where they are the same or it doesn't tell.

    iPhones write Display P3, which is read as Rec.709 a tenth too pale. Only the primaries are taken: the curve is what
    `--transfer` says, or is estimated.
    """
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
    (count,) = struct.unpack_from(">I", profile, PROFILE_HEADER)
    for k in range(min(count, len(profile) // 12)):
        signature, offset, _ = struct.unpack_from(">4sII", profile, PROFILE_HEADER + 4 + 12 * k)
        if signature == name:
            kind, *xyz = struct.unpack_from(">4s4x3i", profile, offset)
            if kind == b"XYZ ":
                return np.array(xyz) / 65536
    raise ValueError("no such tag")


def to_rgb(y: np.ndarray, ry: np.ndarray, by: np.ndarray, chromaticities: tuple[float, ...]) -> np.ndarray:
    """Give linear RGB of the file's own primaries: RY = (R - Y) / Y, BY = (B - Y) / Y, Y = R w_R + G w_G + B w_B.

    Parameters
    ----------
    y : (h, w) float32
    ry, by : (h, w) or (ceil(h / 2), ceil(w / 2)) float32

    Returns
    -------
    (h, w, 3) float32
    """
    weights = rgb_to_xyz(chromaticities)[1]
    weights /= weights.sum()
    height, width = y.shape
    red, blue = ((_full(chroma, (height, width)) + 1) * y for chroma in (ry, by))
    green = (y - weights[0] * red - weights[2] * blue) / weights[1]
    return np.stack([red, green, blue], -1).astype(np.float32)


def _full(chroma: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Chroma at every pixel of `shape`."""
    if chroma.shape == shape:
        return chroma
    chroma = np.nan_to_num(chroma, nan=0.0, posinf=0.0, neginf=0.0)  # one bad sample would spread over 27 pixels
    return _doubled(_doubled(chroma, shape[1]).T, shape[0]).T


def _doubled(lines: np.ndarray, length: int) -> np.ndarray:
    """(n, length) from (n, ceil(length / 2)): the samples, and between them the filter; the ends go on as they are."""
    reach = len(TAPS)
    result = np.repeat(lines, 2, 1)[:, :length]
    padded = np.pad(lines, ((0, 0), (reach - 1, reach)), mode="edge")
    between = length // 2
    result[:, 1::2] = sum(
        tap * (padded[:, k : k + between] + padded[:, 2 * reach - 1 - k : 2 * reach - 1 - k + between])
        for k, tap in enumerate(TAPS)
    )
    return result
