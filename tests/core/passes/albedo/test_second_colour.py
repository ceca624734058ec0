"""A second colour around a place: joints between tiles."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.albedo.albedo import fill
from addon.core.passes.albedo.neighbourhood import shrink
from tests.core.rooms import make_room, quad

TILE, JOINT = 0.75, 0.5


@pytest.fixture(scope="module")
def atlas():
    """One wall of 3 m, 14400 elements."""
    return make_room([quad((0, 0, 0), (3, 0, 0), (0, 3, 0), 0)], 0.025).atlas


@pytest.fixture(scope="module")
def joints(atlas):
    return ((atlas.position[:, :2] + 1e-6) % 0.4 < 0.025).any(1)


def noisy(values, width):
    noise = np.random.default_rng(0).normal(0, width, (len(values), 1))
    return (np.asarray(values)[:, None] * np.exp(noise)).repeat(3, 1).astype(np.float32)


def wall(atlas, rho, error, without=()):
    return shrink(atlas, np.arange(len(atlas)), rho, np.asarray(error, np.float32), without=without)[0]


def test_joints_in_doubt_stay_as_dark_as_they_are(atlas, joints):
    """An eighth of a wall, a third darker: by less than three of the errors that its elements have."""
    assert 0.1 < joints.mean() < 0.15
    rho, error = noisy(np.where(joints, JOINT, TILE), 0.05), np.full(len(atlas), 0.14)
    found = wall(atlas, rho, error)
    assert np.median(found[joints]) == pytest.approx(JOINT, rel=0.03)
    assert np.median(found[~joints]) == pytest.approx(TILE, rel=0.02)
    assert np.median(wall(atlas, rho, error, ("second-colour",))[joints]) > 1.1 * JOINT


def test_an_even_wall_is_as_even_as_without(atlas):
    """Noise has no second colour."""
    rho, error = noisy(np.full(len(atlas), TILE), 0.1), np.full(len(atlas), 0.1)
    found = np.log(wall(atlas, rho, error) / TILE).std()
    assert found < 1.05 * np.log(wall(atlas, rho, error, ("second-colour",)) / TILE).std()


def test_a_joint_of_another_hue_is_told(atlas, joints):
    """As bright as the tiles, in red and blue."""
    tile, joint = np.array([0.5, 0.5, 0.5]), np.array([0.8, 0.5, 0.2])
    rho = (noisy(np.ones(len(atlas)), 0.05) * np.where(joints[:, None], joint, tile)).astype(np.float32)
    found = wall(atlas, rho, np.full(len(atlas), 0.15))
    assert np.allclose(np.median(found[joints], 0), joint, rtol=0.05)
    assert np.allclose(np.median(found[~joints], 0), tile, rtol=0.03)


def test_what_is_in_doubt_is_no_colour(atlas, joints):
    """Lines whose own errors are as large as what they differ by, as E's along a moulding: drawn to the rest."""
    rho = noisy(np.where(joints, JOINT, TILE), 0.03)
    found = wall(atlas, rho, np.where(joints, 0.4, 0.06))
    assert np.median(found[joints]) == pytest.approx(TILE, rel=0.05)


def test_what_is_above_all_albedos_is_no_colour(atlas, joints):
    """Where E is far too small the quotient is cut off at 1: none of that speaks for the elements beside."""
    bright = np.where(joints, 1.4, 0.6)
    weak = joints & (atlas.position[:, 0] > 1.5)
    rho = noisy(np.where(weak, 0.97, bright), 0.02)
    everywhere = np.ones(len(atlas), bool)
    found = fill(atlas, rho, everywhere, {}, set(), np.full(len(atlas), 0.14, np.float32)).rho
    # The same but for the cut itself: a value just below it tells a colour.
    lone = fill(atlas, np.minimum(rho, 0.999), everywhere, {}, set(), np.full(len(atlas), 0.14, np.float32)).rho
    far = joints & (atlas.position[:, 0] < 1)
    assert np.median(found[far]) < np.median(lone[far])


def test_the_rim_of_a_part_may_bear_its_neighbour_s_colour():
    """A grey part next to a white one: its outermost 10 cm are white, and badly measured. A told object's turn grey."""
    grey, white = quad((0, 0, 0), (1.5, 0, 0), (0, 3, 0), 0), quad((1.5, 0, 0), (1.5, 0, 0), (0, 3, 0), 1)
    atlas = make_room([grey, white], 0.025).atlas
    rim = (atlas.object_id == 0) & (atlas.position[:, 0] > 1.4)
    rho = noisy(np.where((atlas.object_id == 1) | rim, 0.7, 0.2), 0.03)
    error, everywhere = np.where(rim, 0.4, 0.1).astype(np.float32), np.ones(len(atlas), bool)

    def median(guesses):
        found = fill(atlas, rho, everywhere, {}, set(), error, guesses=guesses).rho
        grey = (atlas.object_id == 0) & ~rim
        return np.median(found[rim]), np.median(found[grey])

    assert median({0, 1}) == pytest.approx((0.7, 0.2), rel=0.05)
    assert median(())[0] < 0.4
