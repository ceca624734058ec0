"""Interpolation between gathering points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light import interpolate
from addon.core.light.interpolate import interpolated
from addon.core.light.params import GATHER
from tests.core.rooms import box_sides, make_room, quad

FINEST = 0.1


@pytest.fixture(autouse=True)
def several_levels(monkeypatch):
    """In a room of few elements the first spacing would lie below the finest: start coarser, to have levels at all."""
    monkeypatch.setattr(interpolate, "GATHER", replace(GATHER, finest_share=0.075))


@pytest.fixture(scope="module")
def atlas():
    return make_room(box_sides((4, 3, 2.5)), 0.05).atlas


def run(atlas, function, radius=1.5, finest=FINEST):
    """Values over all elements, the points, and how often an element was asked for."""
    asked = []

    def evaluate(index):
        asked.append(index)
        return function(atlas.position[index], atlas.normal[index]), np.full(len(index), radius, np.float32)

    value, points, _ = interpolated(atlas.position, atlas.normal, evaluate, finest, 2)
    assert np.array_equal(np.sort(np.concatenate(asked)), np.sort(points))
    return value, points


def test_a_constant_stays(atlas):
    value, points = run(atlas, lambda p, n: np.tile(np.float32([1, 2, 3, 0.5]), (len(p), 1)))
    assert np.allclose(value, [1, 2, 3, 0.5], rtol=1e-5) and value.shape == (len(atlas), 4)
    assert len(points) < len(atlas) / 20
    assert len(np.unique(points)) == len(points)


def test_each_wall_keeps_its_own(atlas):
    """Value by orientation: nothing leaks round the corner."""

    def by_normal(p, n):
        return (2 + n).astype(np.float32)

    value, points = run(atlas, by_normal)
    off = np.abs(value - by_normal(atlas.position, atlas.normal))
    assert off.max() < 1e-4 and len(points) < len(atlas) / 10


def test_a_linear_field_to_a_few_percent(atlas):
    """Weights without gradients: the error is a part of the change over the distance between points."""

    def linear(p, n):
        return np.repeat(3 + p @ np.float32([[0.5], [-0.4], [0.3]]), 3, 1)

    wanted = linear(atlas.position, None)
    value, points = run(atlas, linear)
    off = np.abs(value / wanted - 1)
    assert np.sqrt((off**2).mean()) < 0.03 and np.percentile(off, 99) < 0.08
    assert len(points) < len(atlas) / 10


def test_a_shadow_edge_gets_more_points(atlas):
    def edge(p, n):
        return np.where(p[:, :1] > 1.7, np.float32(1), np.float32(0.1)).repeat(3, 1)

    value, points = run(atlas, edge)
    even, few = run(atlas, lambda p, n: np.ones((len(p), 3), np.float32))
    x = atlas.position[:, 0]
    along = np.abs(atlas.normal[:, 0]) < 0.5
    near, far = (np.abs(x - 1.7) < 0.2) & along, (np.abs(x - 1.7) > 0.8) & along
    asked = np.isin(np.arange(len(atlas)), points)
    assert asked[near].mean() > 3 * asked[far].mean()
    assert len(few) < len(points) < len(atlas) / 4
    assert np.allclose(value[far], edge(atlas.position[far], None), rtol=1e-3)


def test_close_walls_ask_for_more_points(atlas):
    _, few = run(atlas, lambda p, n: np.ones((len(p), 3), np.float32), radius=4)
    _, many = run(atlas, lambda p, n: np.ones((len(p), 3), np.float32), radius=0.4)
    assert 4 * len(few) < len(many)


def test_light_refines_where_walls_are_far(atlas):
    """The walls are far off (R = 10 m) and ask for nothing; what the points themselves say does, if it is enough."""

    def spot(strength):
        def value(p, n):
            near = ((p[:, :2] - (2.1, 1.4)) ** 2).sum(1) < 0.5**2
            return np.where(near, np.float32(1 + strength), np.float32(1))[:, None].repeat(3, 1)

        return value

    floor = atlas.normal[:, 2] > 0.5
    apart = np.linalg.norm(atlas.position[:, :2] - (2.1, 1.4), axis=1)
    edge, away = floor & (np.abs(apart - 0.5) < 0.1), floor & (apart > 1.5)
    asked = {}
    for strength in (1.0, GATHER.contrast / 2):
        value, points = run(atlas, spot(strength), radius=10)
        asked[strength] = np.isin(np.arange(len(atlas)), points)
        inside = floor & (apart < 0.3)
        assert np.allclose(value[away], 1, rtol=GATHER.contrast / 2)
        if strength == 1:
            assert np.allclose(value[inside], 2, rtol=GATHER.contrast) and np.abs(value[inside] / 2 - 1).mean() < 0.02
    assert asked[1.0][edge].mean() > 4 * asked[1.0][away].mean()
    assert asked[GATHER.contrast / 2][edge].mean() < 2 * asked[GATHER.contrast / 2][away].mean()


def test_coarse_points_do_not_outweigh_fine_ones(atlas):
    """At a shadow's edge the first points lie apart; with R = 100 m they would reach over all that came after."""

    def edge(p, n):
        return np.where(p[:, :1] > 1.7, np.float32(1), np.float32(0.1)).repeat(3, 1)

    value, _ = run(atlas, edge, radius=100)
    x, along = atlas.position[:, 0], np.abs(atlas.normal[:, 0]) < 0.5
    beside = along & (np.abs(x - 1.7) > 2.5 * FINEST)
    off = np.abs(value / edge(atlas.position, None) - 1).max(1)
    assert np.percentile(off[beside], 95) < 0.05 and np.percentile(off[along], 75) < 0.01


def test_small_things_are_not_stepped_over(monkeypatch):
    """A patch of light of 3 % of the room's size, walls far off: found, as the first points lie 1 % apart."""
    monkeypatch.setattr(interpolate, "GATHER", GATHER)
    atlas = make_room([quad((0, 0, 0), (4, 0, 0), (0, 4, 0), 0)], 0.02).atlas
    lit = (np.abs(atlas.position[:, :2] - (1.234, 2.345)) < 0.06).all(1)
    value, points = run(atlas, lambda p, n: spot_of(p), radius=10, finest=0.02)
    assert len(points) < len(atlas) / 3
    assert np.abs(value[lit] / 5 - 1).mean() < GATHER.contrast
    dark = (np.abs(atlas.position[:, :2] - (1.234, 2.345)) > 0.12).any(1)
    assert np.allclose(value[dark], 1, rtol=1e-3)


def spot_of(p):
    return np.where((np.abs(p[:, :2] - (1.234, 2.345)) < 0.06).all(1), np.float32(5), np.float32(1))[:, None]


def test_points_keep_their_distance(atlas):
    """A lone close hit (R = 0) must not ask for every element."""
    _, points = run(atlas, lambda p, n: np.ones((len(p), 3), np.float32), radius=1e-6, finest=0.2)
    assert len(points) < 4 * 59 / 0.2**2 / 2


def test_one_element():
    one = np.zeros((1, 3), np.float32), np.float32([[0, 0, 1]])
    ones = np.ones(1, np.float32)
    value, points, _ = interpolated(*one, lambda index: (np.float32([[7, 8]]), ones), 0.1, 1)
    assert value.tolist() == [[7, 8]] and points.tolist() == [0]
