"""By how many pixels a frame lies beside what the other frames show of the same spots (Lucas and Kanade 1981)."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import map_coordinates

from ..parallel import ordered_map
from ..scene.rays import RayScene
from ..significance import LEVELS
from .edges import Shown
from .params import AGREEMENT, MISALIGNMENT
from .views import SmallView, sees


def predicted(index: int, views: Sequence[SmallView], seen: Sequence[Shown], scene: RayScene) -> np.ndarray:
    """What the other views say that view `index` shows, (height, width) logarithm of grey; NaN where fewer than two."""
    camera, own = views[index].camera, seen[index]
    directions = camera.directions(camera.pixel_centres())
    at = np.flatnonzero((own.triangle >= 0).ravel())
    points = camera.centre + own.distance.ravel()[at, None].astype(np.float64) * directions[at]
    way = [np.linalg.norm(view.camera.centre - camera.centre) for view in views]
    nearest = [j for j in np.argsort(way, kind="stable") if j != index][: AGREEMENT.coarse]
    said = np.full((len(nearest), len(at)), np.nan, np.float32)
    for row, j in enumerate(nearest):
        inside, pixels = sees(views[j].camera, points, scene, margin=1)
        said[row, inside] = bilinear(views[j].log.mean(-1), pixels - 0.5)
    enough = np.isfinite(said).sum(0) >= 2
    image = np.full(camera.height * camera.width, np.nan, np.float32)
    image[at[enough]] = np.nanmedian(said[:, enough], 0)
    return image.reshape(camera.height, camera.width)


def bilinear(image: np.ndarray, at: np.ndarray) -> np.ndarray:
    """`image` ((h, w)) between its pixels, at (n, 2) x and y counted from the first pixel's centre; NaN outside."""
    return map_coordinates(image, at.T[::-1], order=1, cval=np.nan)


def shift(image: np.ndarray, reference: np.ndarray) -> np.ndarray | None:
    """By how many pixels (x, y) `image` lies beside `reference` ((h, w) each, NaN unknown); None where unknown."""
    grid = np.stack(np.meshgrid(*(np.arange(n, dtype=float) for n in reference.shape[::-1])), -1).reshape(-1, 2)
    dy, dx = np.gradient(reference)
    slope = np.stack([dx.ravel(), dy.ravel()], 1)
    moved = np.zeros(2)
    for _ in range(LEVELS.reweighted):
        off = bilinear(image, grid + moved) - reference.ravel()
        good = np.isfinite(off) & np.isfinite(slope).all(1)
        if good.sum() < LEVELS.many:
            return None
        J, r = slope[good], off[good] - np.median(off[good])
        scale = max(float(np.median(np.abs(r))), MISALIGNMENT.least_residual) * LEVELS.sigmas
        weight = np.minimum(1, scale / np.maximum(np.abs(r), 1e-12))
        A = J.T @ (weight[:, None] * J)
        if np.linalg.eigvalsh(A)[0] < MISALIGNMENT.least_texture * good.sum():
            return None
        moved -= np.linalg.solve(A, J.T @ (weight * r))
        if np.abs(moved).max() > MISALIGNMENT.largest:
            return None
    return moved


def misalignments(views: Sequence[SmallView], seen: Sequence[Shown], scene: RayScene) -> np.ndarray:
    """Length of each view's shift in pixels of the full frame, (k,) for the views of which it can be told."""

    def found(i: int) -> np.ndarray | None:
        return shift(views[i].log.mean(-1), predicted(i, views, seen, scene))

    shifts = zip(views, ordered_map(found, range(len(views)), 0), strict=True)
    return np.array([float(np.linalg.norm(by)) * view.step for view, by in shifts if by is not None])
