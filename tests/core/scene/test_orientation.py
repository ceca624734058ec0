"""The front of a triangle is the side that the frames see."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.scene.orientation import seen_sides
from tests.core.rooms import all_round, box_sides, look_at, make_room, quad

CENTRE = (2, 1.5, 1.25)


@pytest.mark.parametrize("seed", [0, 1])
def test_flipped_windings_are_turned_to_the_cameras(seed):
    flip = np.random.default_rng(seed).random(12) < 0.5
    room = make_room(box_sides(), flip=flip)
    sign, _, _ = seen_sides(room.mesh, all_round(CENTRE, 24))
    assert np.array_equal(sign < 0, flip)
    assert set(np.unique(sign)) <= {-1.0, 1.0}


def test_what_no_ray_meets_follows_its_object():
    """Two walls of one object, wound alike; only the first is seen."""
    for backward in (False, True):
        walls = [quad((1, -1, z), (0, 2, 0), (0, 0, 2), 0) for z in (-1, 50)]
        other = [quad((1, -1, 100), (0, 2, 0), (0, 0, 2), 1)]
        room = make_room(walls + other, flip=np.full(6, backward))
        camera = look_at((-2, 0, 0), (1, 0, 0), fov=60)
        sign, _, _ = seen_sides(room.mesh, [camera])
        towards = sign * room.normals[:, 0]
        assert (towards[:4] == -1).all()
        assert (sign[4:] == 1).all()  # an object that nobody sees keeps its winding


def test_footprint_of_a_wall_seen_straight_on():
    room = make_room([quad((3, -9, -9), (0, 18, 0), (0, 0, 18), 0)], 1)
    camera = look_at((0, 0, 0), (1, 0, 0), 40, 40, 20)
    _, footprint, _ = seen_sides(room.mesh, [camera])
    assert footprint == pytest.approx(3 / camera.fx, rel=0.01)


def test_no_cameras_keep_all():
    room = make_room(box_sides())
    sign, footprint, both = seen_sides(room.mesh, [])
    assert (sign == 1).all() and footprint == 0 and not both.any()


def test_a_sheet_seen_from_both_sides_is_told():
    room = make_room([quad((0, -1, -1), (0, 2, 0), (0, 0, 2), 0), quad((9, -1, -1), (0, 2, 0), (0, 0, 2), 1)])
    views = [look_at(eye, (0, 0, 0)) for eye in ((-2, 0, 0), (2, 0.5, 0))]
    assert seen_sides(room.mesh, views).both.tolist() == [True, True, False, False]
    assert not seen_sides(room.mesh, views[:1]).both.any()
