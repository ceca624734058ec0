"""The quotient pi L_d / E, and what stands in where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.albedo.albedo import (
    FILLED,
    MEASURED,
    NONE,
    above_one,
    albedo_of,
    fill,
    quotient,
    without_emitters,
)
from addon.core.passes.albedo.params import ALBEDO
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.visibility import CLEAN
from tests.core.rooms import box_sides, make_room, quad

NAN = np.nan


@pytest.fixture(scope="module")
def atlas():
    return make_room(box_sides(), 0.25).atlas


def test_quotient():
    rho, valid = quotient(np.float32([[1, 2, 3], [NAN, 1, 1], [0.5, 0.5, 0.5]]), np.full((3, 3), 10, np.float32))
    assert valid.tolist() == [True, False, True]
    assert np.allclose(rho[[0, 2]], np.pi * np.float32([[0.1, 0.2, 0.3], [0.05, 0.05, 0.05]]), rtol=1e-6)
    assert np.isnan(rho[1]).all()


def test_darkness_says_nothing():
    """Elements below the floor are left out; a single dark channel is held at the floor."""
    E = np.float32([[1, 1, 1]] * 8 + [[ALBEDO.floor / 2] * 3, [0, 0, 0], [1, 1, 0]])
    rho, valid = quotient(np.full((11, 3), 0.1, np.float32), E)
    assert valid.tolist() == [True] * 8 + [False, False, True]
    assert np.isfinite(rho[valid]).all() and np.isnan(rho[8:10]).all()
    assert rho[10, 2] <= 0.1 * np.pi / (ALBEDO.floor * 2 / 3) * 1.001


def test_quotient_of_nothing():
    rho, valid = quotient(np.full((3, 3), NAN, np.float32), np.ones((3, 3), np.float32))
    assert not valid.any() and np.isnan(rho).all()
    rho, valid = quotient(np.ones((3, 3), np.float32), np.zeros((3, 3), np.float32))
    assert not valid.any()


def by_object(atlas):
    rho = np.empty((len(atlas), 3), np.float32)
    rho[:] = (0.1 * (atlas.object_id + 1))[:, None]
    return rho


def test_gaps_are_filled_from_the_same_object_only(atlas):
    rho, rng = by_object(atlas), np.random.default_rng(0)
    valid = rng.random(len(atlas)) < 0.1
    valid &= ~((atlas.object_id == 0) & (atlas.position[:, 0] > 1))  # a large gap, other walls nearer than the object
    spoilt = np.where(valid[:, None], rho, NAN).astype(np.float32)
    result = fill(atlas, spoilt, valid, {}, set())
    assert np.allclose(result.rho, rho)
    assert np.array_equal(result.origin == MEASURED, valid) and (result.origin[~valid] == FILLED).all()


def test_gaps_take_the_value_around_them():
    """A third of the elements missing in a gradient of 0.2 a metre; what is filled in comes from at most 0.5 m off."""
    atlas = make_room(box_sides(), 0.05).atlas
    rho = (0.1 + 0.2 * atlas.position[:, :1].repeat(3, 1)).astype(np.float32)
    valid = np.arange(len(atlas)) % 3 > 0
    result = fill(atlas, np.where(valid[:, None], rho, NAN).astype(np.float32), valid, {}, set())
    off = np.abs(result.rho - np.minimum(rho, 1))
    assert off.max() < 0.2 * 0.5 and off[valid].max() < 1e-6
    assert np.median(off[~valid]) < 0.2 * 0.15


def test_an_unmeasured_object_looks_to_its_class(atlas):
    """Object 5: of a class that was measured; 4: of one that wasn't, so the room's median."""
    rho = by_object(atlas)
    valid = atlas.object_id < 4
    classes = {0: "wall", 1: "table", 2: "table", 3: "wall", 4: "lamp", 5: "table"}
    result = fill(atlas, np.where(valid[:, None], rho, NAN).astype(np.float32), valid, classes, set())
    five, four = (atlas.object_id == i for i in (5, 4))
    assert np.allclose(result.rho[five], 0.25) and (result.origin[five] == NONE).all()
    assert np.allclose(result.rho[four], np.median(rho[valid])) and (result.origin[four] == NONE).all()


def test_lamps_have_no_albedo(atlas):
    rho = by_object(atlas)
    rho[atlas.object_id == 5] = 30
    valid = np.ones(len(atlas), bool)
    classes = dict.fromkeys(range(6), "table")
    valid[atlas.object_id == 4] = False
    result = fill(atlas, rho, valid, classes, {5})
    lamp = atlas.object_id == 5
    assert (result.rho[lamp] == 0).all() and (result.origin[lamp] == NONE).all()
    assert np.allclose(result.rho[atlas.object_id == 4], 0.25)  # median of 0.1 ... 0.4: the lamp has no say
    assert above_one(rho, without_emitters(atlas, valid, {5})) == 0  # nor do they raise the alarm


def test_nothing_is_above_one_and_the_alarm_is_raised(atlas):
    rho = np.full((len(atlas), 3), 0.5, np.float32)
    rho[: len(atlas) // 4, 1] = 1.5
    valid = np.ones(len(atlas), bool)
    result = fill(atlas, rho, valid, {}, set())
    assert result.rho.max() == 1
    assert above_one(rho, valid) == pytest.approx(0.25, abs=1e-3)


def test_a_room_where_nothing_was_measured(atlas):
    none = np.zeros(len(atlas), bool)
    rho = np.full((len(atlas), 3), NAN, np.float32)
    result = fill(atlas, rho, none, {}, set())
    assert np.allclose(result.rho, 0.5) and (result.origin == NONE).all() and above_one(rho, none) == 0


def highlit_wall(strength):
    """A brown wall with a round highlight that is predicted `strength` times as bright as it is."""
    atlas = make_room([quad((0, 0, 0), (3, 0, 0), (0, 3, 0), 0)], 0.05).atlas
    true, count = np.float32([0.2, 0.1, 0.05]), np.full(len(atlas), 9, np.int32)
    distance = np.linalg.norm(atlas.position - (1.5, 1.5, 0), axis=1)
    highlight = (0.6 * np.exp(-((distance / 0.4) ** 2)))[:, None].repeat(3, 1).astype(np.float32)
    radiance = true + highlight * np.random.default_rng(0).normal(1, 0.03, (len(atlas), 1)).astype(np.float32)
    tier, none = np.full(len(atlas), CLEAN, np.int8), np.zeros(len(atlas), np.float32)
    # The highlight is there in some views and not in others, and so is what is taken too much.
    spread = 0.05 * true + np.abs(strength - 1) * highlight
    rest = LitDiffuse(radiance - strength * highlight, spread, count, tier, none)
    E = np.full((len(atlas), 3), np.pi, np.float32)

    def recovered(without=()):
        return albedo_of(atlas, rest, E, none, (), set(), ("bias-field", *without))

    return recovered, true, distance


@pytest.mark.parametrize("strength", [1.1, 1.2])
def test_a_highlight_that_is_predicted_too_bright_leaves_no_burn(strength):
    recovered, true, distance = highlit_wall(strength)
    middle, outside = distance < 0.3, distance > 1.2
    plain, result = recovered({"albedo-prior"}), recovered()
    off = [np.abs(one.rho[middle] / true - 1).mean() for one in (plain, result)]
    assert off[0] > 0.3 and off[1] < off[0] / 2
    assert np.allclose(result.rho[outside], true, rtol=0.01)
    assert off[1] < 3 * np.median(result.error[middle])  # and its error says how far it may be off
