"""Conventions as text, and what they do to a pose."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.conventions import AS_READ, Convention, all_axes, alternatives, matrix, parse, upright


def rigid(seed: int = 3) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = q * np.sign(np.linalg.det(q))
    pose[:3, 3] = 1, -2, 3
    return pose


def test_there_are_24_turns_and_each_is_one():
    turns = [matrix(axes) for axes in all_axes()]
    assert len({m.tobytes() for m in turns}) == 24 and (turns[0] == np.eye(3)).all()
    for m in turns:
        assert np.linalg.det(m) == pytest.approx(1) and (m @ m.T == np.eye(3)).all()


@pytest.mark.parametrize("text", ["as-read", "opencv", "fipt", "world-to-camera", "scale:0.01", "up:-y",
                                  "world-to-camera,camera:+x-y-z,world:-y+x+z,scale:0.0254,up:+x"])  # fmt: skip
def test_what_is_written_is_read_again(text):
    convention = parse(text)
    assert parse(str(convention)) == convention


def test_every_alternative_is_rigid_and_written_in_its_own_way():
    pose = rigid()
    written = set()
    for convention in alternatives():
        got = convention.pose(pose)
        assert np.allclose(got[:3, :3] @ got[:3, :3].T, np.eye(3)) and np.linalg.det(got[:3, :3]) > 0
        written.add(str(convention))
    assert len(written) == 2 * 4 * 24 and AS_READ in written


def test_opencv_turns_y_and_z_of_the_camera_alone():
    pose = rigid()
    got = parse("opencv").pose(pose)
    assert np.allclose(got[:3, :3], pose[:3, :3] * [1, -1, -1]) and np.allclose(got[:3, 3], pose[:3, 3])


def test_world_to_camera_inverts():
    pose = rigid()
    assert np.allclose(parse("world-to-camera").pose(np.linalg.inv(pose)), pose)


def test_y_up_becomes_z_up_for_poses_and_mesh_alike():
    assert np.allclose(upright("+y") @ [0, 1, 0], [0, 0, 1])
    for axis in ("+x", "-x", "+y", "-y", "+z", "-z"):
        unit = np.zeros(3)
        unit["xyz".index(axis[1])] = float(axis[0] + "1")
        assert np.allclose(upright(axis) @ unit, [0, 0, 1]) and np.linalg.det(upright(axis)) == pytest.approx(1)


@pytest.mark.parametrize("text", ["nonsense", "camera:+x+y-z", "camera:+x+x+z", "scale:0", "scale:nan", "scale:inf",
                                  "scale:", "world:xyz", "up:z", "opencv;fipt"])  # fmt: skip
def test_nonsense_is_refused_in_a_sentence(text):
    with pytest.raises(BadInputError, match="can't be read"):
        parse(text)


def test_a_convention_counts_what_it_changes():
    assert [parse(t).parts for t in ("as-read", "opencv", "world-to-camera,opencv,scale:2")] == [0, 1, 3]
    assert str(Convention()) == AS_READ
