"""PNG, JPEG and TIFF, through OpenImageIO: any number of threads may read at once.

Blender's own builds bring the library. Radiance HDR and EXIF are read by our own code: docs/development.md says why.
"""

import importlib.util
import math
import os
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadInputError
from ..kinds import Code, Limit
from .files import read_bytes
from .picture import check_claim

PNG, JPEG, TIFF = "PNG", "JPEG", "TIFF"
CODED: dict[str, bytes | tuple[bytes, ...]] = {
    PNG: b"\x89PNG\r\n\x1a\n",
    JPEG: b"\xff\xd8\xff",
    TIFF: (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
}
"""How files of each kind begin; TIFF's last two are those of more than 4 GiB."""
READERS = {"png", "jpeg", "tiff"}
"""The library's names of them: it goes by a file's name first, and so might take it for something else."""
DEPTHS = {"uint8": 8, "uint16": 16, "half": 0, "float": 0}
"""Bits of a channel that is stored as codes; 0 for floats."""
WHOLE_BYTES: Code[tuple[int, int, int]] = (8, 16, 32)
PALETTE: Code[int] = 3
"""PNG's kind of colour."""
MAX_RATIO: Limit[int] = 1100
"""No PNG packs more bytes of pixels than this into one of the file: deflate's limit is 1032."""
MAX_SCANS: Limit[int] = 256
"""Of a progressive JPEG, each of which takes a pass over all pixels; encoders write some ten."""
LITTLE: Limit[int] = 1 << 16
"""A claim of fewer bytes is not doubted."""


class Header(NamedTuple):
    """What a picture's header says; `bits` are a channel's, 8 or 16, and 0 for floats."""

    width: int
    height: int
    bits: int


class Stored(NamedTuple):
    """What a picture stores, no curve undone, row 0 at the top.

    Attributes
    ----------
    colour : (h, w, 1) or (h, w, 3)
        uint8 or uint16 codes, or float32. A palette is looked up; 1, 2 and 4 bits are scaled to 0...255.
    alpha : (h, w) of the same type, or None
        PNG's one transparent colour (tRNS) counts as alpha 0.
    profile : bytes
        ICC's; empty where it has none.
    """

    colour: np.ndarray
    alpha: np.ndarray | None
    profile: bytes = b""


def coded_header(path: Path) -> Header:
    """What the header of the PNG, JPEG or TIFF `path` says, its pixels left alone.

    Raises `BadInputError` where it is absent, damaged, larger than any picture, or of a depth that isn't supported; or
    there is no OpenImageIO.
    """
    return _checked(_open(path), path)


def coded_orientation(path: Path) -> int:
    """EXIF's number of how the camera was held; 1: as it is stored. Raises as `coded_header`."""
    return int(_open(path).spec().get_int_attribute("Orientation", 1))


def read_coded(path: Path) -> Stored:
    """Read the pixels of the PNG, JPEG or TIFF `path`.

    As stored: what the file says of colour spaces and of how the camera was held is not heeded here. Raises as
    `coded_header`, and where the pixels are damaged or cut off.
    """
    file = _open(path)
    spec = file.spec()
    width, height, _ = _checked(file, path)
    if file.format_name() == "jpeg" and read_bytes(path).count(b"\xff\xda") > MAX_SCANS:
        raise BadInputError(f"Picture '{path}' has over {MAX_SCANS} scans, as no encoder writes; write it again.")
    count = min(spec.nchannels, 4)
    try:
        pixels = file.read_image(0, count, spec.format)
    except MemoryError:
        pixels = None
    # A JPEG that was cut off comes with an error and with pixels, grey where it ends.
    if file.geterror() or pixels is None or pixels.shape != (height, width, count):
        raise BadInputError(f"Picture '{path}' is damaged or cut off; write or copy it again.")
    colour = pixels[..., : 3 if count >= 3 else 1]
    if file.format_name() == "png" and _png_kind(path)[1] == PALETTE:
        _check_palette(colour, path)
    alpha = spec.alpha_channel
    profile = spec.getattribute("ICCProfile")
    return Stored(
        colour, pixels[..., alpha] if 0 <= alpha < count else None, b"" if profile is None else bytes(profile)
    )


def _library(path: Path) -> Any:
    """The module OpenImageIO; pip's bpy has it in a folder that only Blender as a program puts on the path."""
    if importlib.util.find_spec("OpenImageIO") is None:
        folders = (
            folder.parent
            for entry in sys.path
            for python in ("python*/", "")
            for folder in Path(entry).glob(f"bpy/*/python/lib/{python}site-packages/OpenImageIO")
        )
        sys.path += [str(folder) for folder in folders][:1]
    try:
        import OpenImageIO
    except ImportError as error:
        raise BadInputError(
            f"Picture '{path}' needs OpenImageIO, which this Python has not; install it (pip: "
            "OpenImageIO, Debian: python3-openimageio), or write the picture as OpenEXR."
        ) from error
    return OpenImageIO


def _open(path: Path) -> Any:
    library = _library(path)
    wishes = library.ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)  # else colours are multiplied by alpha
    name: str | bytes = (text := os.fspath(path))
    try:
        text.encode()
    except UnicodeEncodeError:
        name = os.fsencode(path)  # which OpenImageIO takes before 3.2
    try:
        file = library.ImageInput.open(name, wishes)
    except MemoryError:
        file = None
    except TypeError as error:
        raise BadInputError(
            f"The name of picture '{path}' is not UTF-8, which OpenImageIO can't open; rename it."
        ) from error
    if file is None or file.format_name() not in READERS:
        library.geterror()  # cleared, as it is kept for the thread's next picture
        raise BadInputError(f"Picture '{path}' is damaged or cut off; write or copy it again.")
    return file


def _checked(file: Any, path: Path) -> Header:
    """The header, before room for any pixel is made."""
    spec = file.spec()
    width, height, depth = spec.width, spec.height, str(spec.format)
    bits = spec.get_int_attribute("oiio:BitsPerSample", 8)
    if depth not in DEPTHS or (file.format_name() == "tiff" and bits not in WHOLE_BYTES):
        raise BadInputError(
            f"Picture '{path}' has channels of {bits} bits ({depth}), which isn't supported; write PNG or EXR."
        )
    max_bytes = math.inf
    if file.format_name() == "png":
        bits, colour_type = _png_kind(path)
        expansion = 4 if colour_type == PALETTE else 1  # what a pixel of the file becomes when a palette is looked up
        max_bytes = max(LITTLE, expansion * MAX_RATIO * path.stat().st_size) * 8 / min(bits, 8)
    check_claim(path, width, height, spec.image_bytes(), max_bytes)
    return Header(width, height, DEPTHS[depth])


def _png_kind(path: Path) -> tuple[int, int]:
    """Bits and kind of colour of a PNG as it is stored; the library tells what it makes of them."""
    with open(path, "rb") as file:
        bits, colour = file.read(26)[24:]
    return bits, colour


def _check_palette(colour: np.ndarray, path: Path) -> None:
    """Raise `BadInputError` where a PNG's pixels are beyond its palette: the library gives black for them."""
    content, at = path.read_bytes(), 8
    while at < len(content) and content[at + 4 : at + 8] != b"PLTE":
        at += 12 + int.from_bytes(content[at : at + 4], "big")
    entries = content[at + 8 : at + 8 + int.from_bytes(content[at : at + 4], "big")]
    has_black = any(entries[i : i + 3] == bytes(3) for i in range(0, len(entries), 3))
    if not has_black and not colour.any(-1).all():
        raise BadInputError(f"Picture '{path}' is damaged (its palette is too short); write it again.")
