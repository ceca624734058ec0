"""By how many pixels a frame is displaced from what the other frames show of the same spots (Lucas and Kanade 1981)."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import map_coordinates

from ..parallel import ordered_map
from ..scene.rays import RayScene
from ..significance import LEVELS
from .edges import MeshView
from .params import AGREEMENT, MISALIGNMENT
from .views import SmallView, sees


def predicted(index: int, views: Sequence[SmallView], mesh_views: Sequence[MeshView], scene: RayScene) -> np.ndarray:
    """What view `index` shows by the other views, (height, width) logarithm of grey; NaN where fewer than two do."""
    camera, mesh_view = views[index].camera, mesh_views[index]
    directions = camera.directions(camera.pixel_centres())
    hit = np.flatnonzero((mesh_view.triangle >= 0).ravel())
    points = camera.centre + mesh_view.distance.ravel()[hit, None].astype(np.float64) * directions[hit]
    distances = [np.linalg.norm(view.camera.centre - camera.centre) for view in views]
    nearest = [j for j in np.argsort(distances, kind="stable") if j != index][: AGREEMENT.coarse]
    values = np.full((len(nearest), len(hit)), np.nan, np.float32)
    for row, j in enumerate(nearest):
        inside, pixels = sees(views[j].camera, points, scene, margin=1)
        values[row, inside] = bilinear(views[j].log.mean(-1), pixels - 0.5)
    well_seen = np.isfinite(values).sum(0) >= 2
    image = np.full(camera.height * camera.width, np.nan, np.float32)
    image[hit[well_seen]] = np.nanmedian(values[:, well_seen], 0)
    return image.reshape(camera.height, camera.width)


def bilinear(image: np.ndarray, points: np.ndarray) -> np.ndarray:
    """`image` ((h, w)) between its pixels, at (n, 2) x and y counted from the first pixel's centre; NaN outside."""
    return map_coordinates(image, points.T[::-1], order=1, cval=np.nan)


def shift(image: np.ndarray, reference: np.ndarray) -> np.ndarray | None:
    """Pixels (x, y) by which `image` is displaced from `reference` ((h, w) each, NaN unknown); None where unknown."""
    grid = np.stack(np.meshgrid(*(np.arange(n, dtype=float) for n in reference.shape[::-1])), -1).reshape(-1, 2)
    dy, dx = np.gradient(reference)
    slope = np.stack([dx.ravel(), dy.ravel()], 1)
    moved = np.zeros(2)
    for _ in range(LEVELS.reweighted):
        difference = bilinear(image, grid + moved) - reference.ravel()
        good = np.isfinite(difference) & np.isfinite(slope).all(1)
        if good.sum() < LEVELS.many:
            return None
        J, r = slope[good], difference[good] - np.median(difference[good])
        scale = max(float(np.median(np.abs(r))), MISALIGNMENT.least_residual) * LEVELS.sigmas
        weight = np.minimum(1, scale / np.maximum(np.abs(r), 1e-12))
        A = J.T @ (weight[:, None] * J)
        if np.linalg.eigvalsh(A)[0] < MISALIGNMENT.least_texture * good.sum():
            return None
        moved -= np.linalg.solve(A, J.T @ (weight * r))
        if np.abs(moved).max() > MISALIGNMENT.largest:
            return None
    return moved


def misalignments(views: Sequence[SmallView], mesh_views: Sequence[MeshView], scene: RayScene) -> np.ndarray:
    """Length of each view's shift in pixels of the full frame, (k,) for the views whose shift can be measured."""

    def shift_of(i: int) -> np.ndarray | None:
        return shift(views[i].log.mean(-1), predicted(i, views, mesh_views, scene))

    shifts = zip(views, ordered_map(shift_of, range(len(views)), 0), strict=True)
    return np.array([float(np.linalg.norm(offset)) * view.step for view, offset in shifts if offset is not None])
