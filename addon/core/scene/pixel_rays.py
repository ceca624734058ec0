"""The rays of all of a frame's pixels, kept for the frames that share a lens."""

import functools

import numpy as np

from ..kinds import Block
from .lens import Lens
from .model import Camera
from .tangent_frame import dot


def pixel_rays(camera: Camera) -> tuple[np.ndarray, np.ndarray | None]:
    """Unit directions through all pixels' centres in the camera's axes (OpenGL).

    Returns
    -------
    local : (3, height * width) float64
    valid : (height, width) bool, or None
        False: no ray leads to the pixel, and its direction means nothing. None: one leads to each.
    """
    return _pixel_rays(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.lens)


def rays_of_rows(camera: Camera, rows: slice) -> tuple[np.ndarray, np.ndarray | None]:
    """`pixel_rays` of some of the rows; a pinhole's large frame is not kept whole for it."""
    width = camera.width
    if camera.lens is None and width * camera.height > MAX_CACHED_PIXELS:
        return _pinhole_rays(width, rows, camera.fx, camera.fy, camera.cx, camera.cy), None
    local, valid = pixel_rays(camera)
    return local[:, rows.start * width : rows.stop * width], None if valid is None else valid[rows]


MAX_CACHED_PIXELS: Block[int] = 1 << 22
"""Of a pinhole's frame up to which its rays are kept: to make them is a tenth of what tracing them takes."""
CACHED_LENSES: Block[int] = 4
"""Lenses whose rays are kept: a rig's cameras, or one for each thread; 24 bytes a pixel each."""


@functools.lru_cache(maxsize=CACHED_LENSES)
def _pixel_rays(
    width: int, height: int, fx: float, fy: float, cx: float, cy: float, lens: Lens | None
) -> tuple[np.ndarray, np.ndarray | None]:
    if lens is None:
        return _pinhole_rays(width, slice(0, height), fx, fy, cx, cy), None
    x = np.broadcast_to((np.arange(width) + 0.5 - cx) / fx, (height, width))
    y = np.broadcast_to(((cy - np.arange(height) - 0.5) / fy)[:, None], (height, width))
    rays, valid = lens.unproject(np.stack([x.ravel(), -y.ravel()], -1))
    local = np.stack([rays[:, 0], -rays[:, 1], -rays[:, 2]])
    return local, None if valid.all() else valid.reshape(height, width)


def _pinhole_rays(width: int, rows: slice, fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    shape = rows.stop - rows.start, width
    x = np.broadcast_to((np.arange(width) + 0.5 - cx) / fx, shape)
    y = np.broadcast_to(((cy - np.arange(rows.start, rows.stop) - 0.5) / fy)[:, None], shape)
    local = np.stack([x, y, np.full(shape, -1.0)]).reshape(3, -1)
    return local / np.sqrt(dot(local, local))


@functools.lru_cache(maxsize=64)
def _widest(width: int, height: int, fx: float, fy: float, cx: float, cy: float, lens: Lens) -> float:
    local, valid = _pixel_rays(width, height, fx, fy, cx, cy, lens)
    if valid is not None:  # the picture ends where the lens does
        return lens.widest
    rays = local.reshape(3, height, width)
    step = max((float(np.sqrt((np.diff(rays, axis=axis) ** 2).sum(0)).max(initial=0)) for axis in (1, 2)), default=0)
    return min(lens.widest, float(np.arccos(np.clip(-rays[2].max(), -1, 1))) + 2 * step)


def widest_angle(camera: Camera) -> float:
    """An angle from the optical axis (radians) beyond which a camera with a lens sees nothing."""
    return _widest(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.lens)
