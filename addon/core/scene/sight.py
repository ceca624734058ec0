"""What frames see where a mesh could be closed: nothing, something behind, or what no mesh holds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..kinds import Limit
from ..significance import LEVELS
from .model import Camera, Frame, Pixels
from .params import VISIBILITY
from .rays import RayScene

FLOOR: Limit[float] = 1e-4
"""Of radiance, before its logarithm is taken."""


@dataclass(frozen=True)
class Sight:
    """What frames see of n places.

    Attributes
    ----------
    through : (n,) int
        Frames that see the mesh behind it.
    out : (n,) int
        Frames that see no mesh along it.
    place, frame, pixel : (m,) int
        The observations counted in `out`; pixels row by row.
    direction, distance : (m, 3) float32, (m,) float
        From the camera, unit, and metres to the place.
    """

    through: np.ndarray
    out: np.ndarray
    place: np.ndarray
    frame: np.ndarray
    pixel: np.ndarray
    direction: np.ndarray
    distance: np.ndarray


@dataclass(frozen=True)
class RadianceBeyond:
    """What frames show of what no mesh holds, and of the mesh.

    Attributes
    ----------
    value : (m, 3) float
        Log radiance of the observations of a `Sight`; NaN where invalid.
    clipped : (m,) bool
    bright : float
        Mean log radiance that nearly all of the mesh stays below; NaN where frames show none of it.
    views : float
        Frames that see nearly all of the mesh: what so few see was not fused for that reason.
    """

    value: np.ndarray
    clipped: np.ndarray
    bright: float
    views: float


def _visible(camera: Camera, points: np.ndarray, normals: np.ndarray):
    """Points ((n, 3)) that face a camera and lie within its image: indices, pixels, directions, distances."""
    offset = points - camera.centre
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    xy, depth = camera.project(points)
    facing = -(offset * normals).sum(1) >= VISIBILITY.min_cosine * distance
    inside = facing & (depth > 0) & (xy >= 0).all(1) & (xy < (camera.width, camera.height)).all(1)
    index = np.flatnonzero(inside)
    x, y = xy[index].astype(np.int64).T
    return index, y * camera.width + x, (offset[index] / distance[index, None]).astype(np.float32), distance[index]


def sight_of(cameras: Sequence[Camera], scene: RayScene, points: np.ndarray, normals: np.ndarray, gap: float) -> Sight:
    """What cameras see of points ((n, 3)) on planes with `normals`, and behind them.

    `gap` metres before and behind a plane is the mesh's own.
    """
    through, out = np.zeros(len(points), int), np.zeros(len(points), int)
    rows: list[tuple[np.ndarray, ...]] = []
    for number, camera in enumerate(cameras):
        index, pixel, direction, distance = _visible(camera, points, normals)
        hits = scene.intersect(camera.centre, direction)
        escapes = hits.triangle < 0
        beyond = np.where(escapes, 0, hits.distance) - distance
        height = beyond * (direction * normals[index]).sum(1)  # of what is met over the plane
        through[index[~escapes & (height < -gap)]] += 1
        out[index[escapes]] += 1
        rows.append((index[escapes], np.full(escapes.sum(), number), pixel[escapes], direction[escapes],
                     distance[escapes]))  # fmt: skip
    return Sight(through, out, *(np.concatenate(column) for column in zip(*rows, strict=True)))


def colours(
    frames: Sequence[Frame], read: Callable[[Frame], Pixels], sight: Sight, scene: RayScene, points: np.ndarray,
    normals: np.ndarray, gap: float
) -> RadianceBeyond:  # fmt: skip
    """What frames show of what no mesh holds.

    By the `points` of the mesh, with their `normals` ((n, 3) float each), frames' gains are divided out.
    """
    value, clipped = np.full((len(sight.place), 3), np.nan), np.zeros(len(sight.place), bool)
    used, views = np.unique(sight.frame), np.zeros(len(points))
    log_radiance = np.full((len(used), len(points), 3), np.nan)
    for number, frame in enumerate(frames):
        index, pixel, direction, distance = _visible(frame.camera, points, normals)
        hit = np.abs(scene.intersect(frame.camera.centre, direction).distance - distance) < gap
        views[index[hit]] += 1
        row = int(np.searchsorted(used, number))
        if row == len(used) or used[row] != number:
            continue
        pixels = read(frame)
        log = np.log(np.maximum(pixels.radiance.reshape(-1, 3), FLOOR))
        invalid = ~pixels.valid.ravel() | pixels.saturated.ravel()
        index, pixel = index[hit], pixel[hit]
        log_radiance[row, index] = np.where(invalid[pixel, None], np.nan, log[pixel])
        observations = sight.frame == number
        pixel = sight.pixel[observations]
        value[observations] = np.where(pixels.valid.ravel()[pixel, None], log[pixel], np.nan)
        clipped[observations] = pixels.saturated.ravel()[pixel]
    gain = np.zeros((len(used), 1, 3))
    for _ in range(3):
        level = _median(log_radiance - gain, 0)
        gain = np.nan_to_num(_median(log_radiance - level, 1))
    value -= gain[np.searchsorted(used, sight.frame), 0]
    levels = level.mean(-1)[np.isfinite(level).all(-1)]
    bright = float(np.quantile(levels, LEVELS.nearly_all)) if len(levels) else np.nan
    few_views = float(np.quantile(views[views > 0], 1 - LEVELS.nearly_all)) if views.any() else 0.0
    return RadianceBeyond(value, clipped, bright, few_views)


def _median(values: np.ndarray, axis: int) -> np.ndarray:
    """Median along an axis, which is kept, ignoring NaN; NaN where all are."""
    finite = np.isfinite(values).any(axis, keepdims=True)
    return np.where(finite, np.nanmedian(np.where(finite, values, 0), axis, keepdims=True), np.nan)


def between_frames(value: np.ndarray, group: np.ndarray, frame: np.ndarray) -> float:
    """Variance of what different frames ((m,) int) show ((m, 3)) within groups ((m,) int); inf where only one does."""
    pair, label = np.unique(np.stack([group, frame], 1), axis=0, return_inverse=True)
    mean = _means(value, label.ravel())
    _, label = np.unique(pair[:, 0], return_inverse=True)
    freedom = len(mean) - int(label.max()) - 1
    return float(((mean - _means(mean, label)[label]) ** 2).sum() / (3 * freedom)) if freedom else np.inf


def _means(value: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Of the values ((m, 3)) with each label ((m,) int, from 0)."""
    return np.stack([np.bincount(label, column) for column in value.T], 1) / np.bincount(label)[:, None]
