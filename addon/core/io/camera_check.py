"""Plausibility checks of camera parameters: a misplaced decimal point would cause an overflow much later."""

import dataclasses
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..json_values import numbers
from ..kinds import Limit
from ..scene.model import Camera, Frame

FOCAL: Limit[tuple[float, float]] = (1e-3, 1e6)
"""Bounds of a focal length over the frame's longer side; a panorama has 0.16."""
MIN_SIZE: Limit[int] = 2
"""Pixels of a frame's shorter side: edges are differences of two."""
MAX_OFFSET: Limit[int] = 100
"""How many of the frame's sides the principal point may lie from its corner."""
MAX_COEFFICIENT: Limit[float] = 1e9
"""Bound of a lens's coefficients; those of a telephoto lens's high powers are large."""


def pinhole(entry: Any, names: Sequence[str], path: Path) -> Camera:
    """The camera, without a pose, of which a JSON object tells width, height, fx, fy, cx and cy under some `names`.

    Raises `BadInputError` where one is missing or can't be; `path` is the file.
    """
    values = numbers(entry, names)
    if values is None or min(values[:4]) <= 0 or any(value != int(value) for value in values[:2]):
        raise BadInputError(
            f"'{path}' lacks a number among {', '.join(names)}, or one of the first four is not above 0 or no whole "
            "pixels; mend it."
        )
    width, height, fx, fy, cx, cy = values
    return Camera(int(width), int(height), float(fx), float(fy), float(cx), float(cy), np.eye(4))


def check_camera(camera: Camera, name: str) -> None:
    """Raise `BadInputError` where a number of frame `name`'s camera is not finite or beyond what any camera has."""
    side = max(camera.width, camera.height)
    if min(camera.width, camera.height) < MIN_SIZE:
        raise BadInputError(
            f"Frame '{name}' has {camera.width} x {camera.height} pixels, too few to show anything; give larger ones."
        )
    for key, value in (("fx", camera.fx), ("fy", camera.fy)):
        if not FOCAL[0] * side <= value <= FOCAL[1] * side:
            raise BadInputError(
                f"Frame '{name}' has a focal length {key} of {value:.4g} pixels; give pixels, or check "
                "the camera's angle."
            )
    for key, value, extent in (("cx", camera.cx, camera.width), ("cy", camera.cy, camera.height)):
        if not abs(value) <= MAX_OFFSET * extent:
            raise BadInputError(f"Frame '{name}' has a principal point with {key} = {value:.4g}; give pixels.")
    for value in _numbers(camera.lens):
        if not abs(value) <= MAX_COEFFICIENT:
            raise BadInputError(f"Frame '{name}' has a lens with the coefficient {value:.4g}; check its distortion.")


def check_size(frame: Frame, path: Path, size: tuple[int, int]) -> None:
    """Raise `BadInputError` where a picture's width and height are not those of the frame's camera."""
    camera_size = frame.camera.width, frame.camera.height
    if size != camera_size:
        raise BadInputError(
            f"Frame '{frame.name}': '{path}' has {size[0]} x {size[1]} pixels, but its camera has "
            f"{camera_size[0]} x {camera_size[1]}; give them one size."
        )


def _numbers(lens: object) -> Iterator[float]:
    if dataclasses.is_dataclass(lens):
        for field in dataclasses.fields(lens):
            yield from _numbers(getattr(lens, field.name))
    elif isinstance(lens, tuple):
        for item in lens:
            yield from _numbers(item)
    elif isinstance(lens, (int, float)) and not isinstance(lens, bool):
        yield lens if math.isfinite(lens) else math.inf
