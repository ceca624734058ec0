"""Do views agree on the colour of the spots that they share? They do only with the right poses."""

from collections.abc import Sequence

import numpy as np

from ..scene.model import Camera
from ..scene.rays import RayScene
from ..significance import LEVELS
from .params import AGREEMENT
from .views import SmallView, sees


def consistency(
    views: Sequence[SmallView], cameras: Sequence[Camera], scene: RayScene, exposed: bool
) -> tuple[float, float]:
    """Compare views of the same spots: how alike they are, and the share of their rays that meet the mesh.

    That is `colour` and `hit` of a `look.Fit`.

    Parameters
    ----------
    cameras : sequence of Camera
        The views' cameras, in the pose to be tried.
    exposed : bool
        Whether exposures and white balance are known; if not, each two views may differ by a factor in each channel.
    """
    rng = np.random.default_rng(0)
    same_spot, other_spot, hits, rays = [], [], 0, 0
    for i, (view, camera) in enumerate(zip(views, cameras, strict=True)):
        x, y = (
            np.unique(np.linspace(0, n - 1, AGREEMENT.grid).round().astype(int)) for n in (camera.width, camera.height)
        )
        column, row = (a.ravel() for a in np.meshgrid(x, y))
        directions = camera.directions(np.stack([column + 0.5, row + 0.5], -1))
        ray_hits = scene.intersect(camera.centre, directions)
        log_radiance = view.log[row, column]
        rays += len(log_radiance)
        hits += int((ray_hits.triangle >= 0).sum())
        good = (ray_hits.triangle >= 0) & np.isfinite(log_radiance).all(1)
        points = camera.centre + ray_hits.distance[good, None].astype(np.float64) * directions[good]
        log_radiance = log_radiance[good]
        for j, (other, other_camera) in enumerate(zip(views, cameras, strict=True)):
            if j == i:
                continue
            inside, pixels = sees(other_camera, points, scene)
            column, row = pixels.astype(int).T
            other_log = other.log[row, column]
            known = np.isfinite(other_log).all(1)
            inside, other_log = inside[known], other_log[known]
            if len(inside) > 1:
                if not exposed:
                    other_log = other_log + np.median(log_radiance[inside] - other_log, 0)
                same_spot.append(np.abs(log_radiance[inside] - other_log).mean(1))
                other_spot.append(np.abs(log_radiance[inside] - other_log[rng.permutation(len(inside))]).mean(1))
    hit = hits / max(rays, 1)
    if sum(map(len, same_spot)) < LEVELS.many:
        return float("nan"), hit
    a, b = np.concatenate(same_spot), np.concatenate(other_spot)
    return float((a < b).mean() + (a == b).mean() / 2), hit
