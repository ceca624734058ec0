"""What each of many lights throws, against form factors and against each by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light.contributions import contributions, reaching_most
from addon.core.light.environment import Environment
from addon.core.light.few_elements import irradiance_at
from addon.core.light.mirrors import Mirror
from tests.core.rooms import box_sides, cut, make_room, polygon_irradiance, quad

SHADE = [quad((x, -0.2, 2), (0, 0.4, 0), (0.4, 0, 0), 1 + k) for k, x in enumerate((-2.0, 1.0))]


def test_lamps_over_a_floor_throw_what_their_form_factors_tell():
    floor = quad((-3, -2, 0), (6, 0, 0), (0, 4, 0), 0)
    room = make_room([floor, *SHADE], 0.2)
    field, own = room.field(room.by_object({0: (1, 1, 1), 1: (9, 9, 9)})), np.flatnonzero(room.atlas.object_id == 0)
    thrown = np.concatenate([contributions(field, own, groups, seed=0) for groups in ([[1], [2]], [[1, 2]])], 1)
    by_each = [polygon_irradiance(room.atlas.position[own], room.atlas.normal[own], [one])[:, 0] for one in SHADE]
    true = np.stack([*by_each, sum(by_each)], 1)
    assert np.abs(thrown - true).max() < 0.06 * true.max()
    assert thrown.mean(0) == pytest.approx(true.mean(0), rel=5e-3)


def test_a_box_throws_all_that_comes_and_each_side_what_it_throws_alone():
    room = make_room(box_sides(), 0.25)
    field, element = room.field(room.by_object({}, default=(1, 1, 1))), np.arange(len(room.atlas))
    sides = np.unique(room.atlas.object_id).tolist()
    thrown = contributions(field, element, [[one] for one in sides], seed=3)
    assert np.allclose(thrown.sum(1), np.pi, rtol=0.1)
    for k, one in enumerate(sides):
        alone = field.with_light(room.by_object({one: (1, 1, 1)}), Environment.dark(), [one])
        assert np.abs(thrown[:, k] - irradiance_at(alone, element, 5)[:, 0]).mean() < 0.05


def test_a_lamp_throws_light_over_a_mirror_and_none_backwards():
    floor, wall = quad((-3, -2, 0), (6, 0, 0), (0, 4, 0), 0), quad((3, -2, 0), (0, 0, 3), (0, 4, 0), 3)
    room = make_room([floor, SHADE[1], wall], 0.2)
    own = np.flatnonzero(room.atlas.object_id == 0)
    field = room.field(room.by_object({2: (9, 9, 9)}))
    plain = contributions(field, own, [[2]], seed=0)[:, 0]
    glass = Mirror(3, np.float64([3, 0, 0]), np.float64([-1, 0, 0]), np.ones(3))
    image = quad((4.6, -0.2, 2), (0, 0.4, 0), (0.4, 0, 0), 2)
    more = contributions(field.with_mirrors((glass,)), own, [[2]], seed=0)[:, 0] - plain
    true = polygon_irradiance(room.atlas.position[own], room.atlas.normal[own], [image])[:, 0]
    assert more.mean() == pytest.approx(true.mean(), rel=0.1)
    above = make_room([quad((-3, -2, 4), (0, 4, 0), (6, 0, 0), 0), SHADE[1]], 0.2)
    over = np.flatnonzero(above.atlas.object_id == 0)
    assert not contributions(above.field(above.by_object({})), over, [[2]], seed=0).any()


SHELL = [
    quad((-0.2, -0.2, 1.8), (0, 0.4, 0), (0.4, 0, 0), 1),
    quad((0.2, -0.2, 1.8), (0, 0.4, 0), (0, 0, 0.4), 1),
    quad((-0.2, -0.2, 1.8), (0, 0, 0.4), (0, 0.4, 0), 1),
    quad((-0.2, 0.2, 1.8), (0, 0, 0.4), (0.4, 0, 0), 1),
    quad((-0.2, -0.2, 1.8), (0.4, 0, 0), (0, 0, 0.4), 1),
]
"""A box that faces outwards, open at its top."""


@pytest.mark.parametrize("guessed", [False, True])
def test_what_was_fused_of_a_bulb_from_below_lights_the_ceiling(guessed):
    """Of a mesh without objects as if it were whole; elsewhere a lamp is dark from behind."""
    halves = [cut(side, (0, 1), half) for side in SHELL for half in ((0, 0.5), (0.5, 1))]
    room = make_room([quad((-3, -2, 4), (0, 4, 0), (6, 0, 0), 0), *halves], 0.2)
    room = replace(room, mesh=replace(room.mesh, whole=guessed))
    own = np.flatnonzero(room.atlas.object_id == 0)
    radiance = room.by_object({1: (1, 1, 1)})
    field = room.field(radiance).with_light(radiance, lamps=[1])
    thrown, received = contributions(field, own, [[1]], seed=0)[:, 0], irradiance_at(field, own, 0)[:, 0]
    top = quad((-0.2, -0.2, 2.2), (0.4, 0, 0), (0, 0.4, 0), 1)
    seen = [*SHELL[1:], *([top] if guessed else [])]
    position = room.atlas.position[own].astype(float)
    before = [(position - one.corner) @ np.cross(one.edge_u, one.edge_v) > 0 for one in seen]
    true = (polygon_irradiance(position, room.atlas.normal[own], seen) * np.stack(before, 1)).sum(1)
    for found in (thrown, received):
        assert np.abs(found - true).max() < 0.2 * true.max()
        assert found.mean() == pytest.approx(true.mean(), rel=0.03)


def test_the_lamps_that_reach_most_are_those_that_would_throw_most():
    small = quad((2.5, 1.5, 2), (0, 0.05, 0), (0.05, 0, 0), 3)
    room = make_room([quad((-3, -2, 0), (6, 0, 0), (0, 4, 0), 0), *SHADE, small], 0.2)
    own = np.flatnonzero(room.atlas.object_id == 0)
    assert reaching_most(room.field(room.by_object({})), own, [[3], [2], [1]], 2, seed=0) == [1, 2]
    assert contributions(room.field(room.by_object({})), own, [], seed=0).shape == (len(own), 0)
