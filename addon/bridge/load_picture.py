"""Pictures that the core has no decoder for (JPEG, TIFF), through Blender's."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ..core.capture.foreign import foreign_info
from ..core.errors import BadInputError


def load_picture(path: Path) -> np.ndarray:
    """What the file `path` stores, no curve undone.

    What a file says of colour spaces and of how a camera was held is not heeded: poses and curve are the capture's.

    Returns
    -------
    (h, w, 3)
        uint8 or uint16 codes, or float32; row 0 is the top.

    Raises
    ------
    BadInputError
        The file is damaged.
    """
    path = Path(path)
    width, height, bits = foreign_info(path)
    try:
        image = bpy.data.images.load(str(path.absolute()))
    except RuntimeError as error:
        raise BadInputError(f"Picture '{path}' is damaged; write or copy it again.") from error
    try:
        image.colorspace_settings.name = "Non-Color"
        image.alpha_mode = "CHANNEL_PACKED"
        channels = image.channels
        # Blender leaves a picture that it can't decode without a size.
        if tuple(image.size) != (width, height) or not len(image.pixels):
            raise BadInputError(f"Picture '{path}' is damaged or of a kind that Blender can't read; write it as PNG.")
        values = np.empty(width * height * channels, np.float32)
        image.pixels.foreach_get(values)
    finally:
        bpy.data.images.remove(image)
    values = values.reshape(height, width, channels)[::-1]
    values = np.repeat(values[..., :1], 3, -1) if channels < 3 else values[..., :3]
    if not bits:
        return np.ascontiguousarray(values)
    top = (1 << bits) - 1
    return np.rint(values * top).clip(0, top).astype(np.uint8 if bits == 8 else np.uint16)
