"""Do views agree on the colour of the spots that they share? Only with the right poses do they."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..scene.model import Camera
from ..scene.rays import RayScene
from ..significance import LEVELS
from .params import AGREEMENT
from .views import SmallView, sees


class Consistency(NamedTuple):
    """How well views agree.

    Attributes
    ----------
    score : float
        Probability that two views of one spot differ by less than views of two spots: 0.5 by chance, 1 at best; NaN
        where too few spots are shared.
    hit : float
        Share of the views' rays that meet the mesh.
    """

    score: float
    hit: float


def consistency(views: Sequence[SmallView], cameras: Sequence[Camera], scene: RayScene, exposed: bool) -> Consistency:
    """Compare views of the same spots.

    Parameters
    ----------
    cameras : sequence of Camera
        The views' cameras, in the pose to be tried.
    exposed : bool
        Whether exposures and white balance are told; if not, each two views may differ by a factor in each channel.
    """
    rng = np.random.default_rng(0)
    near, far, hits, rays = [], [], 0, 0
    for i, (view, camera) in enumerate(zip(views, cameras, strict=True)):
        x, y = (
            np.unique(np.linspace(0, n - 1, AGREEMENT.grid).round().astype(int)) for n in (camera.width, camera.height)
        )
        column, row = (a.ravel() for a in np.meshgrid(x, y))
        directions = camera.directions(np.stack([column + 0.5, row + 0.5], -1))
        found = scene.intersect(camera.centre, directions)
        own = view.log[row, column]
        rays += len(own)
        hits += int((found.triangle >= 0).sum())
        good = (found.triangle >= 0) & np.isfinite(own).all(1)
        points = camera.centre + found.distance[good, None].astype(np.float64) * directions[good]
        own = own[good]
        for j, (other, eye) in enumerate(zip(views, cameras, strict=True)):
            if j == i:
                continue
            inside, pixels = sees(eye, points, scene)
            column, row = pixels.astype(int).T
            theirs = other.log[row, column]
            known = np.isfinite(theirs).all(1)
            inside, theirs = inside[known], theirs[known]
            if len(inside) > 1:
                if not exposed:
                    theirs = theirs + np.median(own[inside] - theirs, 0)
                near.append(np.abs(own[inside] - theirs).mean(1))
                far.append(np.abs(own[inside] - theirs[rng.permutation(len(inside))]).mean(1))
    hit = hits / max(rays, 1)
    if sum(map(len, near)) < LEVELS.many:
        return Consistency(float("nan"), hit)
    a, b = np.concatenate(near), np.concatenate(far)
    return Consistency(float((a < b).mean() + (a == b).mean() / 2), hit)
