"""OpenEXR in and out, in linear Rec.709: the only module that imports the library."""

from __future__ import annotations

import io
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenEXR

from ..atomic import write_bytes
from ..errors import BadInputError, StorageError
from .exr_header import MAX_RATIO, ExrHeader, parse_header, window_size

REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""x and y of red, green, blue and white; what a file without chromaticities means."""
HALF_MAX = 65504.0


class Picture(NamedTuple):
    """A picture, row 0 at the top.

    Attributes
    ----------
    rgb : (h, w, 3) float32
        Linear Rec.709; NaN where the display window is larger than the data.
    alpha : (h, w) float32 or None
    """

    rgb: np.ndarray
    alpha: np.ndarray | None


def read_header(path: Path | str) -> tuple[int, int]:
    """Width and height of the picture that `read_exr` would give; cheap, and finds a file that was cut off.

    Raises
    ------
    BadInputError
        As `read_exr`, but for damage within the compressed pixels.
    """
    return _supported(Path(path)).size


def read_exr(path: Path | str) -> Picture:
    """Read the picture `path`: half, float or uint; RGB, RGBA or Y; scan lines or tiles.

    The picture is the display window. A file with other primaries than Rec.709 is converted.

    Raises
    ------
    BadInputError
        The file is absent, damaged, cut off, or of a kind that isn't supported.
    """
    path = Path(path)
    header = _supported(path)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            if not file.parts:  # how the library tells of pixels that it failed to decode
                raise ValueError("its pixels can't be decoded")
            # Copies: the arrays belong to the file, and it closes.
            planes = {name: np.array(file.channels()[name].pixels, np.float32) for name in _wanted(header)}
    except MemoryError as error:
        raise BadInputError(f"Picture '{path}' does not fit in memory; scale it down.") from error
    except Exception as error:  # the library raises whatever comes; none of it means anything to a user
        reason = " ".join(str(error).split())[-120:]
        raise BadInputError(f"Picture '{path}' is damaged ({reason}); write or copy it again.") from error
    width, height = window_size(header.data_window)
    if any(plane.shape != (height, width) for plane in planes.values()):
        raise BadInputError(f"Picture '{path}' is damaged (its channels differ in size); write or copy it again.")
    alpha = planes.pop("A", None)
    rgb = np.stack(list(planes.values()) if len(planes) == 3 else [planes["Y"]] * 3, -1)
    if header.chromaticities is not None and len(planes) == 3:
        rgb = _to_rec709(rgb, header.chromaticities, path)
    if header.data_window != header.display_window:
        rgb = _place(rgb, header, np.nan)
        alpha = None if alpha is None else _place(alpha, header, 0.0)
    return Picture(rgb, alpha)


def write_exr(path: Path | str, array: np.ndarray, half: bool = False) -> None:
    """Write `array` as linear Rec.709, in whole or not at all.

    Parameters
    ----------
    array : (h, w), (h, w, 3) or (h, w, 4) float
        Row 0 is the top; channels Y, RGB or RGBA (premultiplied).
    half : bool
        Store 16 bits; values beyond their range are held at its end instead of becoming inf.

    Raises
    ------
    StorageError
        The disk is full or can't be written.
    ValueError
        `array` has another shape: the caller's mistake.
    """
    array = np.asarray(array, np.float32)
    names = {2: "Y", 3: "RGB" if array.shape[-1] == 3 else "RGBA"}.get(array.ndim, "")
    if array.size == 0 or (array.ndim == 3 and array.shape[2] != len(names)) or not names:
        raise ValueError(f"write_exr takes (h, w), (h, w, 3) or (h, w, 4), not {array.shape}")
    if half:
        finite = np.isfinite(array)
        array = np.where(finite, np.clip(array, -HALF_MAX, HALF_MAX, where=finite, out=array.copy()), array)
        array = array.astype(np.float16)
    planes = {name: np.ascontiguousarray(array[..., i] if array.ndim == 3 else array) for i, name in enumerate(names)}
    # Through memory: the library swallows a full disk when it writes its table of chunks last.
    stream = io.BytesIO()
    try:
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, planes).write(stream)
    except RuntimeError as error:
        raise StorageError(f"'{path}' can't be written ({error}); try again with less in memory.") from error
    write_bytes(path, stream.getvalue())


def _wanted(header: ExrHeader) -> list[str]:
    """The channels that are read, colour first; empty where the file has no colour that is understood."""
    names = header.channels
    colour = ["R", "G", "B"] if {"R", "G", "B"} <= names.keys() else ["Y"] if "Y" in names else []
    return colour + ["A"] if "A" in names and colour else colour


def _supported(path: Path) -> ExrHeader:
    """The header of `path`; raises `BadInputError` where `read_exr` has no meaning for it."""
    header = parse_header(path)
    wanted = _wanted(header)
    names = ", ".join(sorted(header.channels)[:6])
    if not wanted:
        raise BadInputError(f"Picture '{path}' holds the channels {names}; write it with R, G and B.")
    if {"RY", "BY"} & header.channels.keys() and "R" not in wanted:
        raise BadInputError(f"Picture '{path}' holds luminance and chroma, which isn't supported; write it as RGB.")
    if any(header.channels[name] != (1, 1) for name in wanted):
        raise BadInputError(f"Picture '{path}' holds subsampled channels, which isn't supported; write it as RGB.")
    (width, height), (data_width, data_height) = header.size, window_size(header.data_window)
    if width * height > max(1 << 24, 16 * data_width * data_height):
        raise BadInputError(f"Picture '{path}' has {data_width} x {data_height} pixels in a display window of "
                            f"{width} x {height}; crop its display window.")
    return header


def _place(plane: np.ndarray, header: ExrHeader, fill: float) -> np.ndarray:
    """Move `plane` from the data window into the display window; `fill` where it says nothing."""
    width, height = header.size
    placed = np.full((height, width, *plane.shape[2:]), fill, np.float32)
    x = header.data_window[0] - header.display_window[0]
    y = header.data_window[1] - header.display_window[1]
    h, w = plane.shape[:2]
    x0, x1, y0, y1 = max(x, 0), min(x + w, width), max(y, 0), min(y + h, height)
    if x0 < x1 and y0 < y1:
        placed[y0:y1, x0:x1] = plane[y0 - y : y1 - y, x0 - x : x1 - x]
    return placed


def _rgb_to_xyz(chromaticities: tuple[float, ...]) -> np.ndarray:
    """(3, 3) matrix from RGB of these primaries to CIE XYZ with Y = 1 at white."""
    x, y = np.array(chromaticities, float).reshape(4, 2).T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y]) if np.all(y != 0) else None
    if xyz is None:  # a primary on the line y = 0 (such as CIE X and Z themselves) has no luminance
        xyz = np.stack([x, y, 1 - x - y])
        xyz[:, 3] /= y[3]
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])


def _to_rec709(rgb: np.ndarray, chromaticities: tuple[float, ...], path: Path) -> np.ndarray:
    """Convert (h, w, 3) from the primaries `chromaticities`; white keeps its XYZ, as OpenEXR's own viewer has it."""
    if np.allclose(chromaticities, REC709, atol=1e-3):
        return rgb
    try:
        with np.errstate(all="raise"):
            matrix = np.linalg.solve(_rgb_to_xyz(REC709), _rgb_to_xyz(chromaticities))
    except (ArithmeticError, np.linalg.LinAlgError):
        matrix = np.full((3, 3), np.nan)
    if not np.all(np.abs(matrix) < MAX_RATIO):
        raise BadInputError(f"Picture '{path}' names primaries that span no colours; write it in linear Rec.709.")
    return rgb @ matrix.T.astype(np.float32)
