"""A picture of the mesh's edges drawn over frames: what a person checks poses with."""

from collections.abc import Callable, Sequence

import numpy as np

from ..io.conventions import Convention
from ..kinds import Shown
from ..photo import photo
from ..scene.model import Capture, Frame, Pixels
from ..scene.rays import RayScene
from .edges import mesh_view

ROWS: Shown[int] = 3
WIDTH: Shown[int] = 640
"""About so many pixels across for each frame."""
LINE: Shown[tuple[int, int, int]] = (255, 90, 0)
GAP: Shown[int] = 8


def overlay(capture: Capture, read: Callable[[Frame], Pixels], conventions: Sequence[Convention]) -> np.ndarray:
    """Some frames, one a row, with the mesh's edges as each convention (one a column) has them, (h, w, 3) uint8."""
    rays = RayScene(capture.mesh.vertices, capture.mesh.triangles)
    chosen = np.unique(np.linspace(0, len(capture.frames) - 1, ROWS + 2).round().astype(int)[1:-1])
    rows = []
    for frame in (capture.frames[i] for i in chosen):
        pixels = read(frame)
        step = max(1, -(-frame.camera.width // WIDTH))
        camera = frame.camera.coarser(step)
        radiance = pixels.radiance[: camera.height * step : step, : camera.width * step : step]
        exposed = radiance[radiance.sum(-1) > 0]
        plain = photo(radiance, float(np.median(exposed)) if len(exposed) else 1.0)
        images = []
        for convention in conventions:
            image = plain.copy()
            image[mesh_view(convention.cameras([camera])[0], capture.mesh, rays).edge] = LINE
            images.append(image)
        rows.append(_beside(images, 1))
    return _beside(rows, 0)


def _beside(images: Sequence[np.ndarray], axis: int) -> np.ndarray:
    """Images in a row (axis 1) or column (axis 0), on black where sizes differ."""
    sizes = np.array([image.shape[:2] for image in images])
    sizes[:, 1 - axis] = sizes[:, 1 - axis].max()
    sizes[:-1, axis] += GAP
    mosaic = [np.zeros((height, width, 3), np.uint8) for height, width in sizes]
    for part, image in zip(mosaic, images, strict=True):
        part[: image.shape[0], : image.shape[1]] = image
    return np.concatenate(mosaic, axis)
