"""Frames of a long video: what shows nothing new is passed over, what does is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from addon.core.scene.frame_choice import with_frames_that_add
from addon.core.scene.model import Capture, Frame
from addon.core.scene.params import FRAME_CHOICE
from tests.core.rooms import box_sides, look_at, make_room


@pytest.fixture(scope="module")
def room():
    return make_room(box_sides(), 0.1)


def capture(room, cameras):
    frames = tuple(Frame(f"{i:04}", Path(f"{i:04}.exr"), camera) for i, camera in enumerate(cameras))
    return Capture(Path("room"), room.mesh, room.instances, frames)


def around(count, place=(2.0, 1.5, 1.2)):
    """Views of the walls one after another, all the way round."""
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return [look_at(place, (np.cos(a), np.sin(a), 0), 64, 48, 60) for a in turn]


def test_a_camera_that_stands_still_gives_as_many_frames_as_are_enough(room):
    still = around(1) * 300
    assert len(with_frames_that_add(capture(room, still)).frames) == FRAME_CHOICE.enough


def test_views_of_elsewhere_from_near_and_from_aside_are_kept(room):
    """Each is one of 300 frames; all others are as good as the same."""
    still = around(1) * 300
    elsewhere = look_at((2.0, 1.5, 1.2), (-1, 0, 0), 64, 48, 60)
    near = look_at((3.7, 1.5, 1.2), (1, 0, 0), 64, 48, 60)
    aside = look_at((3.5, 0.2, 1.2), (0.4, 1, 0), 64, 48, 60)
    for at, camera in ((7, elsewhere), (150, near), (299, aside)):
        cameras = [*still[:at], camera, *still[at + 1 :]]
        names = [frame.name for frame in with_frames_that_add(capture(room, cameras)).frames]
        assert f"{at:04}" in names
        assert names == sorted(names)


def test_frames_are_told_of_and_spread_over_the_video(room):
    chosen = with_frames_that_add(capture(room, around(600)))
    assert f"{600 - len(chosen.frames)} of 600 frames" in chosen.warnings[-1]
    gaps = np.diff([int(frame.name) for frame in chosen.frames])
    assert len(gaps) < 200
    assert gaps.max() < 5 * np.median(gaps)


def test_few_frames_are_all_taken(room):
    whole = capture(room, around(1) * FRAME_CHOICE.few)
    assert with_frames_that_add(whole) is whole
