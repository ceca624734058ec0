"""Whether poses are those of the pictures as they are stored, or turned as their EXIF says.

Most programs that find poses take pictures as stored (COLMAP and nerfstudio do), some turn them first, and no format
tells. The cameras' sizes do where pictures stand on end. Else gravity may: a picture is upright as its EXIF turns it.
HEIC, which every reader turns, is the other way round: it is turned back where cameras fit only that.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..errors import BadInputError
from ..kinds import Unit
from ..scene.model import Frame
from .picture import signs
from .pictures import picture_orientation, picture_size

UPRIGHT: Unit[float] = 0.5
"""Cosine, halfway between a camera that is held upright and one that lies on its side."""


def oriented(frames: Sequence[Frame]) -> tuple[list[Frame], list[str]]:
    """The frames with `turned` as their cameras tell, and sentences where pictures were turned or may have to be.

    Frames whose camera fits both go with those that fit one; where none does, the poses' up decides if it is clear.
    """
    held = {i: orientation for i, frame in enumerate(frames) if (orientation := _orientation(frame)) != 1}
    fits = {i: _fits(frames[i], orientation) for i, orientation in held.items()}
    decided = [fit for fit in fits.values() if fit is not None]
    open_ones = [i for i, fit in fits.items() if fit is None]
    if decided:
        default: bool | None = 2 * sum(decided) > len(decided)
    else:
        default = _by_gravity([(frames[i], held[i]) for i in open_ones])
    turned = {i for i, fit in fits.items() if (default if fit is None else fit)}
    notes = []
    if turned:
        notes.append(
            f"{len(turned)} of {len(frames)} pictures were turned as they tell that the camera was held (EXIF): their "
            "cameras fit them so alone."
        )
    if open_ones and default is None:
        notes.append(
            f"{len(open_ones)} of {len(frames)} pictures are to be turned by their EXIF (the first: "
            f"'{frames[open_ones[0]].name}'), and their cameras fit both ways; they were taken as stored, as COLMAP "
            "and nerfstudio do."
        )
    return [replace(frame, turned=True) if i in turned else frame for i, frame in enumerate(frames)], notes


def _orientation(frame: Frame) -> int:
    """EXIF's number; 1 as well where the picture can't be read, which is told later, or the number is none."""
    try:
        orientation = picture_orientation(frame.path)
    except BadInputError:
        return 1
    return orientation if 1 <= orientation <= 8 else 1


def _fits(frame: Frame, orientation: int) -> bool | None:
    """Whether a frame's camera has the size of its picture turned; None where it is that of both or of neither."""
    stored, wanted = picture_size(frame.path), (frame.camera.width, frame.camera.height)
    turned = stored[::-1] if orientation > 4 else stored
    return None if (wanted == stored) == (wanted == turned) else wanted == turned


def _by_gravity(frames: Sequence[tuple[Frame, int]]) -> bool | None:
    """Whether +Z is up in the pictures turned (True) or as stored (False); None where neither is clear."""
    ups = []
    for frame, orientation in frames:
        x, y = frame.camera.camera_to_world[2, :2]  # how far the camera's right and up point upwards
        down, _ = signs(orientation)
        ups.append((y, down * (-x if orientation > 4 else y)))
    turned, stored = np.mean(ups, 0) if ups else (0.0, 0.0)
    return None if max(turned, stored) < UPRIGHT else bool(turned > stored)
