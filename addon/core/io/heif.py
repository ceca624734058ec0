"""HEIC and HEIF as phones write them, through pillow-heif, which is an extra.

A picture is as the file shows it: turned by its `irot`, which readers have to heed, and so not turned by EXIF again.
Source: ISO/IEC 23008-12, 6.5.10 (irot).
"""

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..kinds import Code, Limit
from .files import read_bytes
from .oiio import Header, Stored
from .picture import check_claim, decoding

HEIC = "HEIC"
BOX: Code[bytes] = b"ftyp"
BRANDS: Code[tuple[bytes, ...]] = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1")
"""How such a file begins, behind the four bytes of its first box's size."""

HEAD: Limit[int] = 1 << 16
"""Bytes in which the properties of the picture are: before all pixels."""


def is_heif(head: bytes) -> bool:
    """Whether a file that begins with `head` is one."""
    return head[4:8] == BOX and head[8:12] in BRANDS


def heif_header(path: Path) -> Header:
    """What the header of `path` says; raises `BadInputError` for a damaged or too large one, or without pillow-heif."""
    with decoding(path):
        return _checked(_open(path), path)


def heif_exif(path: Path) -> bytes:
    """The EXIF of `path`, a TIFF; empty where it has none. Raises as `heif_header`."""
    with decoding(path):
        data = _open(path).info.get("exif") or b""
        return data.removeprefix(b"Exif\0\0")


def heif_orientation(path: Path) -> int:
    """EXIF's number for turning what the file shows back to what the sensor gave, 6 or 8; 1 where sizes can't tell."""
    data = read_bytes(path, "Picture ", HEAD)
    at = data.find(b"irot") + 4
    header = heif_header(path)
    if at < 4 or at >= len(data) or header.width == header.height:
        return 1
    return {1: 6, 3: 8}.get(data[at] & 3, 1)


def read_heif(path: Path) -> Stored:
    """Read the pixels of `path`: uint8 codes, or uint16 where they have 10 or 12 bits, scaled to 0...65535.

    Raises as `heif_header`, and where the pixels are damaged or cut off.
    """
    with decoding(path):
        file = _open(path)
        header = _checked(file, path)
        pixels = np.asarray(file)
        if pixels.ndim == 2:
            pixels = pixels[..., None]
        if pixels.shape[:2] != (header.height, header.width):
            raise ValueError("other pixels than its header says")
        if header.bits == 16:
            top = (1 << int(file.info["bit_depth"])) - 1
            pixels = (np.minimum(pixels, top).astype(np.uint32) * 65535 // top).astype(np.uint16)
        has_alpha = pixels.shape[2] in (2, 4)
        colour = pixels[..., : 3 if pixels.shape[2] >= 3 else 1]
        return Stored(colour, pixels[..., -1] if has_alpha else None, file.info.get("icc_profile") or b"")


def _open(path: Path) -> Any:
    try:
        import pillow_heif
    except ImportError as error:
        raise BadInputError(
            f"Picture '{path}' is HEIC, which needs pillow-heif; install it (pip: pillow-heif) into this Python, or "
            "convert the pictures to JPEG."
        ) from error
    return pillow_heif.open_heif(str(path), convert_hdr_to_8bit=False, hdr_to_16bit=False)


def _checked(file: Any, path: Path) -> Header:
    width, height = file.size
    bits = 8 if int(file.info["bit_depth"]) <= 8 else 16
    check_claim(path, width, height, width * height * 4 * (bits // 8))
    return Header(width, height, bits)
