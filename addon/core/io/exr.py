"""OpenEXR in and out, in linear Rec.709: the only module that imports the library."""

import io
from pathlib import Path

import numpy as np
import OpenEXR

from ..atomic import write_bytes
from ..errors import BadInputError, StorageError
from ..kinds import Unit
from .exr_header import ExrHeader, parse_headers, window_size
from .exr_layers import ExrLayer, choose_layer
from .picture import Picture
from .primaries import REC709, to_rec709, to_rgb

HALF_MAX: Unit[float] = 65504.0


def read_header(path: Path) -> tuple[int, int]:
    """Width and height of the picture that `read_exr` would give; cheap, and finds a file that was cut off.

    Raises as `read_exr`, but for damage within the compressed pixels.
    """
    return _layer_to_read(path)[0].header.size


def exr_note(path: Path) -> str:
    """Which layer or view `read_exr` takes, to end a sentence; '' where there is no other. Raises as `read_header`."""
    return _layer_to_read(path)[1]


def read_exr(path: Path) -> Picture:
    """Read the picture `path`: half, float or uint; RGB, luminance and chroma, or Y; scan lines, tiles or parts.

    The picture is the display window, and the layer is `exr_layers.choose_layer`'s. A file with other primaries than
    Rec.709 is converted. Of a mip-map or rip-map the largest level is read.

    Raises
    ------
    BadInputError
        The file is absent, damaged, cut off, or of a kind that isn't supported.
    """
    layer, _ = _layer_to_read(path)
    header = layer.header
    names = (*layer.colour, *([layer.alpha] if layer.alpha else []))
    planes = _planes(path, layer.part, names)
    for i, plane in enumerate(planes):  # one after the other: a picture of 60 million pixels is large enough once
        planes[i] = plane.astype(np.float32, copy=False)
    del plane
    width, height = window_size(header.data_window)
    for name, plane in zip(names, planes):
        x_sampling, y_sampling = header.channels[name]
        if plane.shape != (-(-height // y_sampling), -(-width // x_sampling)):
            raise BadInputError(f"Picture '{path}' is damaged (its channels differ in size); write or copy it again.")
    alpha = planes.pop() if layer.alpha else None
    chromaticities = header.chromaticities or REC709
    if layer.has_chroma:
        y, ry, by = planes
        rgb = to_rgb(y, ry, by, chromaticities)
    else:
        rgb = np.stack(planes if len(planes) == 3 else planes * 3, -1)
    if len(planes) == 3:
        rgb = to_rec709(rgb, chromaticities, path)
    if header.data_window != header.display_window:
        rgb = _place(rgb, header, np.nan)
        alpha = None if alpha is None else _place(alpha, header, 0.0)
    return Picture(rgb, alpha)


def read_numbers(path: Path) -> np.ndarray:
    """The numbers of the picture `path` as they are stored, not taken as colours: (h, w, c) in their own type.

    Raises as `read_exr`, and where the data window is not the display window.
    """
    headers = parse_headers(path)
    if len(headers) == 1 and list(headers[0].channels.values()) == [(1, 1)]:  # one channel of any name
        header, part, names = headers[0], 0, tuple(headers[0].channels)
    else:
        layer, _ = _layer_to_read(path)
        header, part, names = layer.header, layer.part, layer.colour
    width, height = window_size(header.data_window)
    planes = _planes(path, part, names)
    if header.data_window != header.display_window or any(plane.shape != (height, width) for plane in planes):
        raise BadInputError(f"Picture '{path}' is cropped, or its channels differ in size; write it whole.")
    return np.stack(planes, -1)


def _planes(path: Path, part: int, names: tuple[str, ...]) -> list[np.ndarray]:
    """Channels of a part, in their own types; raises `BadInputError` where they can't be decoded."""
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            if not file.parts:  # how the library tells of pixels that it failed to decode
                raise ValueError("its pixels can't be decoded")
            # Copies: the arrays belong to the file, and it closes.
            channels = file.channels(part)
            return [np.array(channels[name].pixels) for name in names]
    except MemoryError as error:
        raise BadInputError(f"Picture '{path}' does not fit in memory; scale it down.") from error
    except Exception as error:  # the library raises whatever comes; none of it means anything to a user
        reason = " ".join(str(error).split())[-120:]
        raise BadInputError(f"Picture '{path}' is damaged ({reason}); write or copy it again.") from error


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
        clipped = np.clip(array, -HALF_MAX, HALF_MAX, where=np.isfinite(array), out=array.copy())
        array = clipped.astype(np.float16)
    planes = {name: np.ascontiguousarray(array[..., i] if array.ndim == 3 else array) for i, name in enumerate(names)}
    # Through memory: the library swallows a full disk when it writes its table of chunks last.
    stream = io.BytesIO()
    try:
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, planes).write(stream)
    except RuntimeError as error:
        raise StorageError(f"'{path}' can't be written ({error}); try again with less in memory.") from error
    with stream.getbuffer() as content:  # let go of, or the stream can't be closed
        write_bytes(path, content)


def _layer_to_read(path: Path) -> tuple[ExrLayer, str]:
    """The layer to read of `path`, and `choose_layer`'s note; raises `BadInputError` where `read_exr` can't read it."""
    layer, note = choose_layer(parse_headers(path), path)
    header = layer.header
    x, y = header.data_window[:2]
    for name in (*layer.colour, *([layer.alpha] if layer.alpha else [])):
        may_be_halved = layer.has_chroma and name.upper().endswith(("RY", "BY"))
        if header.channels[name] not in ([(1, 1), (2, 2)] if may_be_halved and x % 2 == y % 2 == 0 else [(1, 1)]):
            raise BadInputError(f"Picture '{path}' holds subsampled channels, which isn't supported; write it as RGB.")
    (width, height), (data_width, data_height) = header.size, window_size(header.data_window)
    if width * height > max(1 << 24, 16 * data_width * data_height):
        raise BadInputError(
            f"Picture '{path}' has {data_width} x {data_height} pixels in a display window of "
            f"{width} x {height}; crop its display window."
        )
    return layer, note


def _place(plane: np.ndarray, header: ExrHeader, fill: float) -> np.ndarray:
    """Move `plane` from the data window into the display window; `fill` outside of the data."""
    width, height = header.size
    placed = np.full((height, width, *plane.shape[2:]), fill, np.float32)
    x = header.data_window[0] - header.display_window[0]
    y = header.data_window[1] - header.display_window[1]
    h, w = plane.shape[:2]
    x0, x1, y0, y1 = max(x, 0), min(x + w, width), max(y, 0), min(y + h, height)
    if x0 < x1 and y0 < y1:
        placed[y0:y1, x0:x1] = plane[y0 - y : y1 - y, x0 - x : x1 - x]
    return placed
