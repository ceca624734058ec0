"""A few frames at a small size, with what the mesh shows in each of their pixels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import BadInputError
from ..scene.model import Camera, Frame, Pixels
from ..scene.rays import RayScene
from .params import AGREEMENT


@dataclass(frozen=True)
class SmallView:
    """A frame at a small size.

    Attributes
    ----------
    camera : Camera
        Of the small picture.
    log : (height, width, 3) float32
        Natural logarithm of the radiance; NaN where the frame says nothing.
    step : int
        Pixels of the frame along an edge of one of these.
    """

    camera: Camera
    log: np.ndarray
    step: int


def small_views(frames: Sequence[Frame], read: Callable[[Frame], Pixels]) -> list[SmallView]:
    """`AGREEMENT.count` of the frames, evenly spread; those that can't be read are left out."""
    chosen = np.unique(np.linspace(0, len(frames) - 1, AGREEMENT.count).round().astype(int)) if frames else ()
    views = []
    for frame in (frames[i] for i in chosen):
        try:
            pixels = read(frame)
        except BadInputError:  # it is reported where the frames are read in full
            continue
        shorter = min(frame.camera.width, frame.camera.height)  # a narrow strip still needs room for edges
        step = max(1, min(round(frame.camera.width / AGREEMENT.width), shorter // 2))
        camera = frame.camera.coarser(step)
        views.append(SmallView(camera, _small(pixels, step), step))
    return views


def sees(
    camera: Camera, points: np.ndarray, scene: RayScene, margin: float = 0.0, slack: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Which points of the mesh a camera sees unoccluded, and at which pixels.

    Parameters
    ----------
    points : (n, 3) float64
    margin : float
        Pixels along the picture's edges that don't count.
    slack : float
        Share of the distance within which triangles before a point don't hide it: those of a noisy mesh.

    Returns
    -------
    index : (k,) int
    pixels : (k, 2) float64
        x and y.
    """
    pixels, depth = camera.project(points)
    end = camera.width - margin, camera.height - margin
    index = np.flatnonzero((depth > 0) & (pixels >= margin).all(1) & (pixels < end).all(1))
    to_camera = camera.centre - points[index]
    distance = np.maximum(np.linalg.norm(to_camera, axis=1, keepdims=True), 1e-12)
    to_camera /= distance
    origins = points[index] + to_camera * (4 * scene.offset + slack * distance)
    reach = (1 - slack) * distance[:, 0] - 8 * scene.offset
    visible = ~scene.occluded(*(np.asarray(a, np.float32) for a in (origins, to_camera, reach)))
    return index[visible], pixels[index[visible]]


def _small(pixels: Pixels, step: int) -> np.ndarray:
    """Logarithm of the mean over blocks; a block with a pixel that says nothing is NaN."""
    small = pixels.coarser(step)
    radiance = small.radiance[small.valid]
    floor = 1e-3 * float(np.median(radiance)) if len(radiance) else 1.0
    log = np.log(np.maximum(small.radiance, max(floor, 1e-30)))
    return np.where(small.valid[..., None], log, np.nan).astype(np.float32)
