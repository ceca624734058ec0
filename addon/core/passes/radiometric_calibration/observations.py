"""Codes of the same places of the surface in all frames that show them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

from ...agreement.views import sees
from ...parallel import ordered_map
from ...progress import Progress, Rounds
from ...scene.model import Frame, Mesh, Pixels
from ...scene.params import SMALL, VISIBILITY
from ...scene.rays import RayScene
from ...scene.visibility import bytes_of_frame
from .params import CALIBRATION


@dataclass(frozen=True)
class CodeObservations:
    """m observations of some places.

    Attributes
    ----------
    point : (m,) int
    frame : (m,) int
    r2 : (m,) float
        Squared distance from the principal point over focal length.
    code : (m, 3) float
        0...1.
    histogram : (f, 3, 256) float
        Of each frame's codes by channel, as a share of its pixels: of the middle, by which cameras meter.
    """

    point: np.ndarray
    frame: np.ndarray
    r2: np.ndarray
    code: np.ndarray
    histogram: np.ndarray

    def part(self, index: np.ndarray) -> CodeObservations:
        """Some of them."""
        return CodeObservations(self.point[index], self.frame[index], self.r2[index], self.code[index], self.histogram)


def observe_codes(
    mesh: Mesh,
    scene: RayScene,
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    *,
    threads: int = 0,
    seed: int = 0,
    progress: Progress | Rounds | None = None,
) -> CodeObservations:
    """The frames' codes at places spread over the surface that they see, where codes are flat and not clipped.

    Parameters
    ----------
    read : callable
        A frame's codes as "radiance", 0...1.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """
    places, normals = _places(mesh, scene, frames, seed)
    observations = []

    def observe(index: int) -> CodeObservations:
        return _in_frame(index, frames[index], read(frames[index]), scene, places, normals)

    frame_bytes = bytes_of_frame(frame.camera for frame in frames)
    for index, observed in enumerate(ordered_map(observe, range(len(frames)), threads, each=frame_bytes)):
        observations.append(observed)
        if progress is not None:
            progress.update((index + 1) / len(frames))
    return CodeObservations(*(np.concatenate([getattr(observed, name) for observed in observations])
                              for name in ("point", "frame", "r2", "code", "histogram")))  # fmt: skip


def _places(mesh: Mesh, scene: RayScene, frames: Sequence[Frame], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """World positions and unit normals, (n, 3) each, of first hits through random pixels."""
    rng = np.random.default_rng(seed)
    count = max(CALIBRATION.points // len(frames), CALIBRATION.least_points)
    normal, _ = mesh.geometry
    places, normals = [], []
    for frame in frames:
        camera = frame.camera
        directions, valid = camera.rays(rng.uniform((0, 0), (camera.width, camera.height), (count, 2)))
        hits = scene.intersect(np.broadcast_to(np.float32(camera.centre), directions.shape), directions)
        on_surface = valid & (hits.triangle >= 0)
        facing = normal[hits.triangle[on_surface]]
        facing = facing * -np.sign(np.einsum("ij,ij->i", facing, directions[on_surface]))[:, None]
        places.append(camera.centre + hits.distance[on_surface, None].astype(np.float64) * directions[on_surface])
        normals.append(facing)
    return np.concatenate(places), np.concatenate(normals)


def _in_frame(
    index: int, frame: Frame, pixels: Pixels, scene: RayScene, places: np.ndarray, normals: np.ndarray
) -> CodeObservations:
    step = max(round(max(frame.camera.width, frame.camera.height) / SMALL.width), 1)
    camera = frame.camera.coarser(step)
    small = pixels.coarser(step)
    code = gaussian_filter(small.radiance, (SMALL.blur, SMALL.blur, 0))
    window = (2 * SMALL.off + 1, 2 * SMALL.off + 1)
    spread = maximum_filter(code, (*window, 1)) - minimum_filter(code, (*window, 1))
    flat = (spread <= CALIBRATION.flat * code).all(-1) & ~maximum_filter(~small.valid | small.saturated, window)
    flat &= code.min(-1) >= CALIBRATION.darkest

    towards = camera.centre - places
    cosine = np.einsum("ij,ij->i", towards, normals) / np.maximum(np.linalg.norm(towards, axis=1), 1e-30)
    points = np.flatnonzero(cosine > CALIBRATION.grazing)
    visible, at = sees(camera, places[points], scene, SMALL.off, VISIBILITY.depth_tolerance)
    column, row = at.astype(int).T
    usable = flat[row, column]
    points, at, column, row = points[visible[usable]], at[usable], column[usable], row[usable]
    r2 = np.square((at - (camera.cx, camera.cy)) / (camera.fx, camera.fy)).sum(1)
    return CodeObservations(
        points, np.full(len(points), index), r2, code[row, column].astype(np.float64), _histogram(pixels)[None]
    )


def _histogram(pixels: Pixels) -> np.ndarray:
    height, width = pixels.valid.shape
    above, left = int(height * CALIBRATION.border), int(width * CALIBRATION.border)
    middle = np.s_[above : height - above, left : width - left]
    code = np.rint(pixels.radiance[middle][pixels.valid[middle]] * 255).astype(np.uint8)
    count = np.stack([np.bincount(code[:, c], minlength=256) for c in range(3)])
    return count / max(len(code), 1)
