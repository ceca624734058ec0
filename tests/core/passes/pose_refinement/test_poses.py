"""Poses that are off are put right by what the frames show together; good ones stay as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.errors import InterruptedRun
from addon.core.lit_diffuse.accumulate import accumulate
from addon.core.passes.pose_refinement.poses import POSES, Poses, Texture, moved, refine_poses
from addon.core.progress import Progress
from addon.core.scene.model import Pixels
from tests.core.lit_diffuse.test_accumulate import frames_of
from tests.core.rooms import all_round, box_sides, make_room, patches, picture, quad

EYES = [(0.8 + 0.4 * i, 0.7 + 0.5 * (i * 3 % 4), 1.1 + 0.2 * (i * 5 % 3)) for i in range(7)]
WIDTH = 96


class Filmed:
    """A box, a block in it, and pictures of them from poses that are `off` (radians, metres) in what is told."""

    def __init__(self, light=lambda room: patches(room, 0.3), off=(0.008, 0.015)):
        block = [quad((1.8, 1.2, 0.9), (0, 0.6, 0), (0.6, 0, 0), 6), quad((1.8, 1.2, 0), (0.6, 0, 0), (0, 0, 0.9), 6),
                 quad((2.4, 1.2, 0), (0, 0.6, 0), (0, 0, 0.9), 6), quad((2.4, 1.8, 0), (-0.6, 0, 0), (0, 0, 0.9), 6),
                 quad((1.8, 1.8, 0), (0, -0.6, 0), (0, 0, 0.9), 6)]  # fmt: skip
        self.room = make_room([*box_sides(), *block], 0.05)
        self.light = np.asarray(light(self.room), np.float32)
        self.true = [camera for eye in EYES for camera in all_round(eye, WIDTH)]
        self.pictures = [self.soft(camera) for camera in self.true]
        rng = np.random.default_rng(3)
        ways = rng.normal(size=(len(self.true), 6)) * np.repeat(off, 3) / np.sqrt(3)
        self.told = [moved(camera, way) for camera, way in zip(self.true, ways)]

    def soft(self, camera) -> Pixels:
        """A picture whose pixels are means over 3 x 3, as a sensor's are over their area."""
        fine = replace(
            camera,
            width=3 * camera.width,
            height=3 * camera.height,
            fx=3 * camera.fx,
            fy=3 * camera.fy,
            cx=3 * camera.cx,
            cy=3 * camera.cy,
        )
        return picture(self.room, fine, self.light).coarser(3)

    def refined(self, cameras=None, **options) -> Poses:
        room, frames = self.room, frames_of(cameras or self.told)

        def read(frame):
            return self.pictures[int(frame.name)]

        lit = accumulate(room.mesh, room.atlas, room.scene, frames, read, threads=2)
        texture = Texture(room.field(np.nan_to_num(lit.radiance)), lit.seen)
        return refine_poses(frames, read, texture, threads=2, **options)

    def apart(self, cameras) -> np.ndarray:
        """Pixels by which each camera shows the room beside the true one, (f,) root mean square over what it sees."""
        found = []
        for camera, true in zip(cameras, self.true):
            at = np.random.default_rng(0).uniform(0, true.width, (300, 2))
            directions = true.directions(at)
            hits = self.room.scene.intersect(np.broadcast_to(np.float32(true.centre), directions.shape), directions)
            shown, _ = camera.project(true.centre + hits.distance[:, None].astype(np.float64) * directions)
            found.append(np.sqrt(((shown - at) ** 2).sum(1).mean()))
        return np.array(found)


@pytest.fixture(scope="module")
def filmed() -> Filmed:
    return Filmed()


def test_poses_that_are_off_are_put_right(filmed):
    poses = filmed.refined()
    assert poses.moved.mean() > 0.8 and poses.shift > POSES.least_shift
    found = [frame.camera for frame in poses.of(frames_of(filmed.told))]
    before, after = filmed.apart(filmed.told), filmed.apart(found)
    assert np.median(before) > 0.6
    assert np.median(after) < 0.4 * np.median(before) and np.mean(after < before) > 0.9
    for pose in poses.camera_to_world:
        assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-9)


def test_good_poses_stay_to_the_last_bit(filmed):
    poses = filmed.refined(filmed.true)
    assert not poses.moved.any() and poses.shift < 0.7 * POSES.least_shift
    frames = frames_of(filmed.true)
    assert all(a is b for a, b in zip(poses.of(frames), frames))


@pytest.mark.slow
def test_without_texture_nothing_is_said():
    """A room of one colour: its only edges are a wall's against the next, and those look alike."""
    poses = Filmed(lambda room: np.ones((len(room.atlas), 3))).refined()
    assert not poses.moved.any() and np.isnan(poses.shift)


@pytest.mark.slow
def test_frames_that_are_no_good_harm_no_other(filmed):
    """One frame shows something else altogether, one is masked out, one is brighter by a stop than told."""
    other, before = Filmed(lambda room: patches(room, 0.3, 1)), filmed.apart(filmed.told)
    bright = int(np.argsort(before)[3 * len(before) // 4])
    strange, blind = [i for i in range(3) if i != bright][:2]
    kept = list(filmed.pictures)
    filmed.pictures[strange] = other.pictures[strange]
    filmed.pictures[blind] = replace(kept[blind], valid=np.zeros_like(kept[blind].valid))
    filmed.pictures[bright] = replace(kept[bright], radiance=2 * kept[bright].radiance)
    try:
        poses = filmed.refined()
    finally:
        filmed.pictures[:] = kept
    assert not poses.moved[blind]
    found = filmed.apart([frame.camera for frame in poses.of(frames_of(filmed.told))])
    assert found[strange] < before[strange] + 1.5 and found[bright] < 0.6 * before[bright]
    rest = np.delete(np.arange(len(found)), [strange, blind])
    assert np.median(found[rest]) < 0.4 * np.median(before[rest])


def test_a_stop_is_heeded(filmed):
    with pytest.raises(InterruptedRun):
        filmed.refined(progress=Progress(should_stop=lambda: True))
