"""Radiance of a frame: pictures read, exposure divided out, brackets merged, invalid pixels marked."""

from dataclasses import replace

import numpy as np

from ..errors import BadInputError
from ..photo import srgb_to_linear
from ..scene.model import AUTO, Camera, Frame, Pixels, Shot
from ..scene.pixel_rays import pixel_rays
from .brackets import Exposed, merge
from .exr import HALF_MAX
from .pictures import read_mask, read_picture
from .transfer import CODES, LINEAR

NOISE = 1e-4
"""Negative values down to this come from filtering and count as 0."""
OPAQUE = 0.99
"""A pixel of less alpha is a mixture of what was seen and nothing."""


def read_pixels(frame: Frame) -> Pixels:
    """Read what `frame` measured: exposure divided out, masked and impossible pixels marked.

    Raises
    ------
    BadInputError
        A picture is damaged, or of another size than the camera.
    """
    shape = frame.camera.height, frame.camera.width
    seen = np.ones(shape, bool)
    if frame.mask_path is not None:
        mask = read_mask(frame.mask_path)
        if mask.shape != shape:
            raise BadInputError(f"Frame '{frame.name}': mask '{frame.mask_path}' differs in size; make it the frame's.")
        seen &= mask
    if frame.margin:
        for edge in (seen, seen[::-1], seen.T, seen.T[::-1]):
            edge[: frame.margin] = False
    in_image_circle = pixel_rays(frame.camera)[1] if frame.camera.lens is not None else None
    if in_image_circle is not None:  # beyond the lens's image circle
        seen &= in_image_circle
    if frame.brackets:
        shots = sorted(frame.shots, key=lambda s: s.exposure)
        radiance, valid, saturated = merge(_exposed(frame, shot, seen) for shot in shots)
    else:
        rgb, valid, saturated, *_ = _exposed(frame, frame.shots[0], seen)
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            radiance = rgb / np.float32(frame.exposure if frame.radiometry is None else 1)
    valid &= np.isfinite(radiance).all(-1)
    radiance[~valid] = 0
    return Pixels(radiance.astype(np.float32, copy=False), valid, saturated)


def as_codes(frame: Frame) -> Frame:
    """A frame with the curve `AUTO` whose codes, 0...1, `read_pixels` gives as they are."""
    return replace(frame, transfer=CODES, exposure=1.0, radiometry=None)


def _exposed(frame: Frame, shot: Shot, seen: np.ndarray) -> Exposed:
    """One exposure of `frame`; `seen` ((h, w) bool) is False where no exposure says anything."""
    auto = frame.transfer == AUTO
    rgb, alpha, to_rec709 = read_picture(shot.path, LINEAR if auto else frame.transfer, frame.turned)
    if rgb.shape[:2] != seen.shape:
        raise BadInputError(f"Frame '{frame.name}': '{shot.path}' changed its size during the run; start again.")
    # A half float overflows to inf: the pixel was bright, but it gives no value at all, not even a bound. Writers that
    # hold what is brighter at a half's end give a bound.
    clipped = ((rgb >= shot.saturation) | (rgb == HALF_MAX) | np.isposinf(rgb)).any(-1)
    if alpha is not None and (alpha > 0).any():  # some writers leave all of alpha at 0 and mean nothing by it
        seen = seen & (alpha >= OPAQUE)
    usable = seen & (np.isfinite(rgb) & (rgb >= -NOISE)).all(-1)
    saturation = shot.saturation
    if auto and frame.radiometry is not None:
        rgb = frame.radiometry.radiance(rgb, _r2(frame.camera))
    elif auto:
        rgb, saturation = srgb_to_linear(rgb).astype(np.float32), float(srgb_to_linear(np.array(saturation)))
    if to_rec709 is not None and frame.transfer != CODES:
        rgb = rgb @ to_rec709.T
    return Exposed(np.maximum(rgb, 0), usable, clipped & seen, shot.exposure, saturation)


def _r2(camera: Camera) -> np.ndarray:
    """Squared distance of each pixel from the principal point over focal length, (h, w) float64."""
    x, y = np.arange(camera.width) + 0.5 - camera.cx, np.arange(camera.height) + 0.5 - camera.cy
    return np.square(x / camera.fx) + np.square(y / camera.fy)[:, None]
