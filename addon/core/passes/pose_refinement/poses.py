"""Pose refinement by aligning each frame with the texture of all frames.

Each frame is compared with L_d, the room's texture, which is the median of all of them: where a picture's gradients
show it misaligned with the texture, its camera is moved and turned (Lucas and Kanade 1981 for six degrees of freedom;
Zhou and Koltun 2014, "Color Map Optimization", in turn with the texture as there). The mesh stays where it is, so the
frames come to agree with it, not only with each other.

First a few frames are tested. If they are aligned, as in a capture whose poses are good, nothing is done.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter, minimum_filter
from scipy.spatial.transform import Rotation

from ...agreement.params import AGREEMENT, MISALIGNMENT
from ...parallel import ordered_map
from ...progress import Progress, Rounds
from ...scene.model import Camera, Frame, Pixels
from ...scene.params import SMALL
from ...scene.visibility import bytes_of_frame
from ...significance import LEVELS, SIGMA_OF_MAD
from ...weighted import weighted_median

if TYPE_CHECKING:
    from ...light.field import LightField


@dataclass(frozen=True)
class PoseParams:
    """Of `poses` (`pose-refinement` in the ablation).

    Attributes
    ----------
    least_shift : float
        Pixels of the small picture, median over the frames: less is what good poses show for highlights, texels and
        noise. Six rooms with their true poses have 0.05 to 0.23; the living room with poses off by 5 mm and 0.2 degrees
        has 0.7.
    samples : int
        Rays along an edge of each of these pixels, so that the texture's edges are as soft as the picture's.
    least_gradient : float
        Of log radiance over a pixel; less says nothing of a shift.
    floor : float
        Share of the room's median radiance that is added before the logarithm: noise in the dark must not count.
    rounds : int
        All frames are refined so often, each against the others as last refined.
    least_spread : float
        Of the logarithm: a picture of flat colours fits to the last bit but at its edges, which alone are informative.
    independent : float
        Share of the pixels whose errors are independent: neighbours share what the texture has wrong.
    stray : float
        Times the median shift: a frame that would move farther has gone astray. It shows mirrors, or something that
        moved.
    worse : float
        A frame goes back if its cost becomes so many times what it was. Most of the cost is the texture's error:
        without any slack a third of two rooms' frames went back, most of them from better places.
    sky : float
        Times the room's diagonal, where rays that escape are taken to end.
    """

    least_shift: float = 0.4
    samples: int = 2
    least_gradient: float = 0.01
    floor: float = 0.1
    rounds: int = 2
    least_spread: float = 0.05
    independent: float = 0.05
    stray: float = 4.0
    worse: float = 1.05
    sky: float = 100.0


POSES = PoseParams()

ROTATION = np.radians(1.0)
"""Standard deviation of the rotation error that is expected of unknown poses."""


@dataclass(frozen=True)
class Poses:
    """Where the frames were taken from.

    Attributes
    ----------
    camera_to_world : (f, 4, 4) float64
    shift : () float
        Pixels by which frames are misaligned with the texture, median over those tested; NaN if none is usable.
    moved : (f,) bool
        Whether a frame's pose was corrected.
    """

    camera_to_world: np.ndarray
    shift: np.ndarray
    moved: np.ndarray

    @classmethod
    def as_read(cls, frames: Sequence[Frame], shift: float = float("nan")) -> Poses:
        """Those of the capture."""
        poses = np.reshape([frame.camera.camera_to_world for frame in frames], (-1, 4, 4)).astype(np.float64)
        return cls(poses, np.array(shift), np.zeros(len(frames), bool))

    def of(self, frames: Sequence[Frame]) -> tuple[Frame, ...]:
        """The frames in these poses."""
        return tuple(
            replace(frame, camera=replace(frame.camera, camera_to_world=pose)) if moved else frame
            for frame, pose, moved in zip(frames, self.camera_to_world, self.moved, strict=True)
        )


@dataclass(frozen=True)
class Texture:
    """The room as all frames show it together.

    Attributes
    ----------
    seen : (n,) bool
        Elements that have an L_d.
    """

    field: LightField
    seen: np.ndarray

    @cached_property
    def floor(self) -> float:
        """Radiance that is added before the logarithm."""
        return max(POSES.floor * float(np.median(self.field.radiance[self.seen])), 1e-30)

    def render(self, camera: Camera, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What a camera sees in pixels of columns `x` and rows `y` ((m,) int).

        Returns
        -------
        radiance : (m, 3) float64
        distance : (m,) float
            Metres, of the nearest that the pixel shows.
        known : (m,) bool
            All that it shows has an L_d.
        """
        radiance = np.zeros((len(x), 3))
        distance = np.full(len(x), POSES.sky * self.field.scene.diagonal)
        known = np.ones(len(x), bool)
        origins = np.broadcast_to(camera.centre.astype(np.float32), (len(x), 3))
        for part in range(POSES.samples**2):
            at = np.stack(
                [x + (part % POSES.samples + 0.5) / POSES.samples, y + (part // POSES.samples + 0.5) / POSES.samples],
                -1,
            )
            directions, valid = camera.rays(at)
            hits = self.field.scene.intersect(origins, directions)
            element = self.field.elements(hits)
            radiance += self.field.arriving(hits, element, directions)
            distance = np.minimum(distance, hits.distance)
            known &= valid & ((element < 0) | self.seen[element])
        return radiance / POSES.samples**2, distance, known


@dataclass(frozen=True)
class Step:
    """How one frame's camera should move.

    Attributes
    ----------
    motion : (6,) float
        Rotation vector in radians and metres, in the camera's axes.
    shift : float
        Pixels of the small picture by which that moves what it shows, root mean square over the pixels used.
    cost : float
        How badly the frame fits where it is: mean of its residuals' sizes, large ones cut off, pixels weighted by
        their gradients.
    """

    motion: np.ndarray
    shift: float
    cost: float


def moved(camera: Camera, motion: np.ndarray) -> Camera:
    """The camera turned by a rotation vector and moved ((6,): radians, metres) in its own axes."""
    pose = camera.camera_to_world.copy()
    pose[:3, 3] += pose[:3, :3] @ motion[3:]
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(motion[:3]).as_matrix()
    return replace(camera, camera_to_world=pose)


def _flow(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Derivative of points' pixels ((m, 3) world) by the camera's motion, (m, 2, 6) in pixels per radian, metre."""
    projected, _ = camera.project(points)
    epsilon = 1e-5
    motions = epsilon * np.eye(6)
    return np.stack([(moved(camera, motion).project(points)[0] - projected) / epsilon for motion in motions], -1)


def step_of(camera: Camera, pixels: Pixels, texture: Texture, rotation: float = ROTATION) -> Step | None:
    """Compare a picture with the texture; None where too little of it shows anything.

    Parameters
    ----------
    camera : Camera
        Of this very picture.
    rotation : float
        Radians about each axis, the standard deviation that is expected; and of the place what moves the picture as
        much. Turning and moving look nearly alike: what the picture does not distinguish stays as it is.
    """
    floor = texture.floor
    picture = np.log(np.maximum(pixels.radiance, 0) + floor).mean(-1).astype(np.float64)
    good = minimum_filter(pixels.valid & ~pixels.saturated, 2 * round(2 * SMALL.blur) + 1)
    inner = np.zeros_like(good)
    inner[SMALL.off : -SMALL.off, SMALL.off : -SMALL.off] = True
    good &= inner
    dx, dy = (gaussian_filter(picture, SMALL.blur, order=order) for order in ((0, 1), (1, 0)))
    gradient = np.where(good, np.hypot(dx, dy), 0)
    count = min(LEVELS.sample, gradient.size - 1)
    threshold = max(float(np.partition(gradient.ravel(), -count)[-count]), POSES.least_gradient)
    y, x = np.nonzero(gradient >= threshold)
    if len(x) < LEVELS.many:
        return None
    radiance, distance, known = texture.render(camera, x, y)
    x, y = x[known], y[known]
    if len(x) < LEVELS.many:
        return None
    residual = picture[y, x] - np.log(np.maximum(radiance[known], 0) + floor).mean(-1)
    directions = camera.directions(np.stack([x + 0.5, y + 0.5], -1)).astype(np.float64)
    flow = _flow(camera, camera.centre + distance[known, None] * directions)
    # The texture's image T moves with the camera: T - gradient . flow motion + gain = picture.
    jacobian = -(dx[y, x, None] * flow[:, 0] + dy[y, x, None] * flow[:, 1])
    gradient_weight = gradient[y, x] ** 2
    # The sky has no distance.
    depth = min(float(np.median(distance[known])), texture.field.scene.diagonal)
    expected = rotation * np.r_[np.ones(3), np.full(3, depth)]
    motion = _fit(np.column_stack([jacobian, np.ones(len(x))]), residual, gradient_weight, expected)
    shift = float(np.sqrt(((flow @ motion) ** 2).sum(1).mean()))
    deviation = np.abs(residual - weighted_median(residual, gradient_weight))
    return Step(
        motion,
        shift,
        float(np.average(np.minimum(deviation, LEVELS.outlier * POSES.least_spread), weights=gradient_weight)),
    )


def _fit(jacobian: np.ndarray, residual: np.ndarray, gradient_weight: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """The motion, (6,), by robust least squares under a prior; the last column of `jacobian` is a gain's.

    `expected` ((6,)) are the prior's standard deviations. `gradient_weight` ((m,)) weighs the pixels in the estimate of
    the residuals' spread: where the picture is flat they are small wherever the camera is, and would make those at
    edges look like outliers.
    """
    prior = np.diag(np.r_[expected**-2, 0])
    solution = np.zeros(7)
    for _ in range(LEVELS.reweighted):
        remainder = residual - jacobian @ solution
        spread = max(SIGMA_OF_MAD * weighted_median(np.abs(remainder), gradient_weight), POSES.least_spread)
        weight = POSES.independent / spread**2 / (1 + (remainder / (LEVELS.outlier * spread)) ** 2)
        weighted = jacobian * weight[:, None]
        solution = np.linalg.solve(weighted.T @ jacobian + prior, weighted.T @ residual)
    return solution[:6]


def refine_poses(
    frames: Sequence[Frame],
    read: Callable[[Frame], Pixels],
    texture: Texture,
    *,
    threads: int = 0,
    progress: Progress | Rounds | None = None,
) -> Poses:
    """Align the frames with the texture.

    Parameters
    ----------
    frames : sequence of Frame
        In the poses that `texture` was made with.
    read : callable
        Gives a frame's pixels.

    Returns
    -------
    Poses
        As read if the frames fit already (`least_shift`). Frames that show too little, or fit no better elsewhere,
        stay where they are in any case.

    Raises
    ------
    InterruptedRun
        From `progress`.
    """

    def compare(item: tuple[Frame, Camera], shift: float = np.inf) -> Step | None:
        frame, camera = item
        step = -(-camera.width // SMALL.width)
        small = camera.coarser(step)
        return step_of(small, read(frame).coarser(step), texture, min(shift * small.pixel_angle, ROTATION))

    sample = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, AGREEMENT.count).round().astype(int))]
    frame_bytes = bytes_of_frame(frame.camera for frame in frames)
    first_steps = ordered_map(compare, [(frame, frame.camera) for frame in sample], threads, each=frame_bytes)
    valid_steps = [step for step in first_steps if step]
    shift = float(np.median([step.shift for step in valid_steps])) if valid_steps else float("nan")
    if not shift >= POSES.least_shift:
        return Poses.as_read(frames, shift)
    cameras = [frame.camera for frame in frames]
    cost, farthest = np.full(len(frames), np.inf), min(MISALIGNMENT.largest, POSES.stray * shift)
    moves = np.ones(len(frames), bool)
    for iteration in range(POSES.rounds):
        todo = np.flatnonzero(moves)
        # Frames are off by as much as those that were tested: what one needs is expected of all.
        steps = ordered_map(
            lambda item: compare(item, shift), [(frames[i], cameras[i]) for i in todo], threads, each=frame_bytes
        )
        for done, (i, step) in enumerate(zip(todo, steps, strict=True), 1):
            if progress is not None:
                progress.update((iteration + done / len(todo)) / POSES.rounds)
            if step is None or step.shift > farthest or step.cost > POSES.worse * cost[i]:
                cameras[i], moves[i] = frames[i].camera, False
            else:
                cameras[i], cost[i] = moved(cameras[i], step.motion), step.cost
    return Poses(np.stack([camera.camera_to_world for camera in cameras]), np.array(shift), moves)
