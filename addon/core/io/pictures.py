"""Reading frames and masks of every supported picture format, recognised by content, not by file name."""

from pathlib import Path

import numpy as np

from ..errors import BadInputError
from . import exr_header, radiance_hdr
from .exif import exif_orientation
from .exr import exr_note, read_exr, read_header
from .files import check_picture, read_bytes
from .heif import HEIC, heif_header, heif_orientation, is_heif, read_heif
from .oiio import CODED, TIFF, coded_header, coded_orientation, read_coded
from .picture import Picture, turn
from .primaries import profile_to_rec709
from .radiance_hdr import hdr_size, read_hdr
from .raw import DNG, is_dng, raw_size, read_raw
from .transfer import decode

EXR, HDR = "OpenEXR", "Radiance HDR"
ENDINGS = (".exr", ".hdr", ".pic", ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".heic", ".heif", ".hif", ".dng")
"""Endings of picture files, in the order in which a missing ending is tried."""


def picture_kind(path: Path) -> str:
    """One of the kinds above, of `oiio`, `heif.HEIC` or `raw.DNG`.

    Raises `BadInputError` where the file is absent, empty, or of a kind that isn't known.
    """
    check_picture(path)
    head = read_bytes(path, "Picture ", 16)
    if not head:
        raise BadInputError(f"Picture '{path}' is empty; write or copy it again.")
    kinds: dict[str, bytes | tuple[bytes, ...]] = {EXR: exr_header.MAGIC, HDR: radiance_hdr.MAGIC, **CODED}
    for kind, magic in kinds.items():
        if head.startswith(magic):
            return DNG if kind == TIFF and is_dng(path) else kind
    if is_heif(head):
        return HEIC
    raise BadInputError(
        f"Picture '{path}' is not an OpenEXR, Radiance HDR, PNG, JPEG, TIFF, HEIC or DNG file, or is damaged; "
        "write it as OpenEXR."
    )


def picture_size(path: Path, turned: bool = False) -> tuple[int, int]:
    """Width and height in pixels, from the header alone; finds an OpenEXR file that was cut off.

    Parameters
    ----------
    turned : bool
        Of the picture as its EXIF shows it, in place of what is stored.

    Raises
    ------
    BadInputError
        The file is absent, damaged, or of a kind that isn't supported.
    """
    readers = {EXR: read_header, HDR: hdr_size, DNG: raw_size, HEIC: heif_header}
    width, height = readers.get(picture_kind(path), coded_header)(path)[:2]
    return (height, width) if turned and picture_orientation(path) > 4 else (width, height)


def picture_orientation(path: Path) -> int:
    """EXIF's orientation, 1 (as stored, or not stated) to 8. Raises as `picture_size`."""
    kind = picture_kind(path)
    if kind in CODED:
        return coded_orientation(path)
    return {HEIC: heif_orientation, DNG: exif_orientation}.get(kind, lambda _: 1)(path)


def picture_bits(path: Path) -> int:
    """Bits of a channel of curve-encoded codes, 8 or 16; 0 of linear floats. Raises as `picture_size`."""
    kind = picture_kind(path)
    return heif_header(path).bits if kind == HEIC else coded_header(path).bits if kind in CODED else 0


def picture_note(path: Path) -> str:
    """What was chosen where a file holds several pictures, as the end of a sentence; '' for most."""
    return exr_note(path) if picture_kind(path) == EXR else ""


def read_picture(path: Path, transfer: str = "", turned: bool = False) -> Picture:
    """A frame's numbers, linear (see `Picture.to_rec709`); 1 is the greatest code of a picture of 8 or 16 bits.

    Parameters
    ----------
    transfer : str
        Curve of codes (`transfer.to_linear`).
    turned : bool
        As its EXIF shows it, in place of what is stored.

    Raises
    ------
    BadInputError
        The file is absent, damaged, of a kind that isn't supported, or has codes but no curve.
    """
    kind = picture_kind(path)
    if kind == EXR:
        return read_exr(path)
    if kind == HDR:
        return read_hdr(path)
    if not transfer and picture_bits(path):
        raise BadInputError(unstated_curve(path))
    colour, alpha, profile = {HEIC: read_heif, DNG: read_raw}.get(kind, read_coded)(path)
    if turned:
        orientation = picture_orientation(path)
        colour, alpha = turn(colour, orientation), None if alpha is None else turn(alpha, orientation)
    if colour.shape[2] == 1:
        colour = np.repeat(colour, 3, -1)
    if colour.dtype.kind == "f":
        return Picture(np.ascontiguousarray(colour, np.float32), alpha)
    scale = np.float32(np.iinfo(colour.dtype).max)
    return Picture(decode(colour, transfer), None if alpha is None else alpha / scale, profile_to_rec709(profile))


def unstated_curve(path: Path) -> str:
    """The error message for a picture of codes whose curve is not stated."""
    return (
        f"Picture '{path}' holds 8 or 16-bit codes among frames of floats; make all frames alike, or give the codes' "
        "curve with --transfer (auto, srgb, linear, or a gamma such as 2.2)."
    )


def read_mask(path: Path) -> np.ndarray:
    """(h, w) bool: False where the mask is black. Raises as `read_picture`."""
    colour = read_coded(path).colour if picture_kind(path) in CODED else read_picture(path).rgb
    return (colour > 0).any(-1)
