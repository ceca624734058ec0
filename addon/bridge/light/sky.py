"""What a world sends from a direction, coarsely: its picture in 16 by 32 fields."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Vector

from ..data.images import image_array
from ..data.nodes import find_node
from .kelvin import LUMINANCE

_ROWS, _COLUMNS = 16, 32
_maps: dict[tuple, np.ndarray] = {}


def sky(world: bpy.types.World, direction: Vector, turn: float) -> float:
    """Luminance from a direction at strength 1, in the frames' unit; 0 where the world shows no picture or colour.

    Parameters
    ----------
    direction : Vector
        Unit, from the room outwards.
    turn : float
        Radians by which the picture is turned about +Z, anticlockwise from above.
    """
    node = find_node(world, "BACKGROUND")
    if node is None:
        return 0.0
    socket = node.inputs["Color"]
    image = getattr(socket.links[0].from_node, "image", None) if socket.links else None
    if image is None:
        return 0.0 if socket.links else float(np.array(socket.default_value[:3]) @ LUMINANCE)
    # As Cycles lays it: the picture's middle is -X, and its rows go from below to above.
    across = 0.5 - (math.atan2(direction.y, direction.x) - turn) / (2 * math.pi)
    up = 0.5 + math.asin(min(max(direction.z, -1.0), 1.0)) / math.pi
    fields = _fields(image)
    return float(fields[min(int(up * _ROWS), _ROWS - 1), int(across * _COLUMNS) % _COLUMNS])


def _fields(image: bpy.types.Image) -> np.ndarray:
    """The luminance of a picture, averaged in fields; row 0 is below."""
    key = image.name, image.filepath, tuple(image.size)
    if key not in _maps:
        pixels = np.nan_to_num(image_array(image)[..., :3], posinf=0.0).clip(0) @ LUMINANCE
        height, width = pixels.shape
        rows, columns = (
            np.linspace(0, size, count + 1).astype(int)[:-1]
            for size, count in ((height, min(_ROWS, height)), (width, min(_COLUMNS, width)))
        )
        summed = np.add.reduceat(np.add.reduceat(pixels, rows, 0), columns, 1)
        counts = np.outer(np.diff([*rows, height]), np.diff([*columns, width]))
        small = summed / counts
        _maps[key] = small[np.arange(_ROWS) * len(rows) // _ROWS][:, np.arange(_COLUMNS) * len(columns) // _COLUMNS]
    return _maps[key]
