"""Albedo shrunk towards its surroundings: what is drawn to them and what is left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.passes.albedo.albedo import FILLED, MEASURED, fill
from addon.core.passes.albedo.neighbourhood import relative_error, shrink
from addon.core.passes.albedo.params import PRIOR
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.visibility import CLEAN, EDGE, SATURATED
from addon.core.significance import LEVELS
from tests.core.rooms import make_room, quad

GOOD, POOR, NONE = PRIOR.least_error, 0.8, np.inf


@pytest.fixture(scope="module")
def atlas():
    """One wall of 3 m, 3600 elements."""
    return make_room([quad((0, 0, 0), (3, 0, 0), (0, 3, 0), 0)], 0.05).atlas


def run(atlas, rho, error, without=()):
    own = np.arange(len(atlas))
    return shrink(atlas, own, rho.astype(np.float32), error.astype(np.float32), without=without)[0]


def grey(values):
    return np.asarray(values, np.float32)[:, None].repeat(3, 1)


def checks(atlas, size, low=0.2, high=0.6):
    odd = (np.floor(atlas.position[:, :2] / size).astype(int).sum(1) % 2).astype(bool)
    return grey(np.where(odd, high, low))


def test_a_texture_of_well_measured_elements_survives(atlas):
    """Patches of 10 cm whose albedo spreads by 40 %: log albedo keeps its contrast."""
    patch = np.floor(atlas.position[:, :2] / 0.1).astype(int) @ [1, 40]
    rho = grey(0.3 * np.exp(np.random.default_rng(0).normal(0, 0.4, patch.max() + 1))[patch])
    result = run(atlas, rho, np.full(len(atlas), GOOD))
    off = np.log(result / rho)
    assert np.median(np.abs(off)) < 0.03 and np.percentile(np.abs(off), 99) < 0.2
    assert np.log(result).std() > 0.9 * np.log(rho).std()


@pytest.mark.parametrize("share", [0.5, 0.3, 0.1])
def test_a_pattern_of_well_measured_elements_survives(atlas, share):
    """Stripes, dark on bright: the rarer value is no error, as long as it is well measured."""
    dark = atlas.position[:, 0] % 0.5 < share * 0.5 - 1e-6
    noise = np.exp(np.random.default_rng(0).normal(0, 0.03, (len(atlas), 3)))
    result = run(atlas, grey(np.where(dark, 0.2, 0.6)) * noise, np.full(len(atlas), GOOD))
    assert np.median(result[dark]) == pytest.approx(0.2, rel=0.15)
    assert np.median(result[~dark]) == pytest.approx(0.6, rel=0.05)


def test_texture_of_an_even_wall_outlives_what_e_errs_by(atlas):
    """Each element's error is as large as the texture's contrast; most of it is E's, which the neighbours share."""
    texture = grey(0.3 * np.exp(np.random.default_rng(0).normal(0, 0.12, len(atlas))))
    error, own = np.full(len(atlas), 0.12, np.float32), np.arange(len(atlas))
    bent = replace(atlas, normal=np.where(np.arange(len(atlas))[:, None] % 2, [[0, 0, 1]], [[0, 0.6, 0.8]]))
    contrast = {
        name: np.log(shrink(one, own, texture, error, shared=0.95 * error)[0]).std()
        for name, one in (("even", atlas), ("bent", bent))
    }
    assert contrast["even"] > 0.7 * np.log(texture).std() > contrast["bent"]


def test_an_outlier_on_an_even_wall_is_pulled_in(atlas):
    rng = np.random.default_rng(0)
    rho = 0.5 * np.exp(rng.normal(0, 0.03, (len(atlas), 3)))
    error = np.full(len(atlas), GOOD)
    lone = rng.choice(len(atlas), 60, replace=False)
    rho[lone], error[lone] = 0.1, POOR  # a depth edge: another surface was mixed in
    result = run(atlas, rho, error)
    assert np.abs(result[lone] / 0.5 - 1).max() < 0.05
    assert np.abs(np.delete(result, lone, 0) / 0.5 - 1).mean() < np.abs(np.delete(rho, lone, 0) / 0.5 - 1).mean()


def test_a_well_measured_outlier_stays_nearer_to_itself(atlas):
    """The more it is in doubt, the further it moves; never past its neighbours."""
    rho = checks(atlas, 0.1, 0.4, 0.5)
    middle, results = len(atlas) // 2, []
    rho[middle] = 0.9
    for error in (0.02, GOOD, 0.3, POOR):
        doubts = np.full(len(atlas), GOOD)
        doubts[middle] = error
        results.append(float(run(atlas, rho, doubts)[middle, 0]))
    assert results == sorted(results, reverse=True)
    assert results[0] > 0.85 and results[-1] < 0.6 and min(results) > 0.4


def test_colour_is_drawn_in_as_well(atlas):
    rho = np.tile(np.float32([0.6, 0.3, 0.1]), (len(atlas), 1))
    error = np.full(len(atlas), GOOD)
    rho[1000], error[1000] = (0.1, 0.3, 0.6), POOR
    assert np.allclose(run(atlas, rho, error)[1000], (0.6, 0.3, 0.1), rtol=0.03)


def blotch(atlas, size):
    """A square in the middle of the wall, and the third of its elements that are in doubt."""
    inside = (np.abs(atlas.position[:, :2] - 1.5) < size / 2).all(1)
    poor = inside & (np.random.default_rng(1).random(len(atlas)) < 0.3)
    return inside, poor


def test_errors_that_neighbours_share_lose_their_say_further_out():
    """A blotch of light that is 10 % off, as wide as the nearest neighbourhood, on a wall measured to 15 %."""
    wall = make_room([quad((0, 0, 0), (3, 0, 0), (0, 3, 0), 0)], 0.03).atlas
    inside, _ = blotch(wall, 0.5)
    _, poor = blotch(wall, 0.3)
    rho = 0.5 * np.exp(np.random.default_rng(0).normal(0, 0.15, (len(wall), 1))).repeat(3, 1)
    rho[inside] *= 1.1
    error = np.where(poor, POOR, 0.15)
    wide = np.median(run(wall, rho, error)[poor])
    near = np.median(run(wall, rho, error, without=("wide-prior",))[poor])
    assert abs(wide / 0.5 - 1) < 0.03 and near / 0.5 - 1 > 0.05


def test_surroundings_that_differ_are_left_out():
    """A dark square no larger than that on a bright wall: what is in doubt in it stays dark."""
    wall = make_room([quad((0, 0, 0), (3, 0, 0), (0, 3, 0), 0)], 0.03).atlas
    _, poor = blotch(wall, 0.2)
    inside, _ = blotch(wall, 0.7)
    noise = np.exp(np.random.default_rng(0).normal(0, 0.03, (len(wall), 3)))
    rho, error = grey(np.where(inside, 0.2, 0.6)) * noise, np.where(poor, POOR, GOOD)
    assert np.allclose(run(wall, rho, error)[poor], 0.2, rtol=0.1)
    assert np.allclose(run(wall, rho, error, without=("second-colour",))[poor], 0.2, rtol=0.1)


def test_stripes_on_a_ground_that_covers_more_stay(atlas):
    """Stripes of a third of a rug that one frame saw: the median deviation around them is the ground's own."""
    stripe = atlas.position[:, 0] % 0.3 < 0.1
    noise = np.exp(np.random.default_rng(0).normal(0, 0.03, (len(atlas), 3)))
    rho = grey(np.where(stripe, 0.25, 0.6)) * noise
    seen_once = atlas.position[:, 1] < 1.2
    error = np.where(seen_once, 0.35, GOOD)
    assert np.median(run(atlas, rho, error)[stripe & seen_once]) < 0.33


@pytest.mark.parametrize("axis", [0, 1])
def test_a_gradient_is_not_shifted(atlas, axis):
    """Albedo from 0.1 to 0.7; gaps and doubtful elements come out right in the mean, to either side."""
    rho = grey(0.1 + 0.2 * atlas.position[:, axis])
    kind = np.random.default_rng(0).integers(0, 3, len(atlas))
    result = run(atlas, rho, np.choose(kind, (GOOD, POOR, NONE)))
    inner = (np.abs(atlas.position[:, :2] - 1.5) < 1).all(1)  # at the rim the neighbours lie to one side
    for one in range(3):
        off = (result / rho - 1)[inner & (kind == one)]
        assert abs(off.mean()) < 0.015 and np.abs(off).max() < 0.3, one
    rising = np.polyfit(atlas.position[inner, axis], result[inner, 0], 1)[0]
    assert rising == pytest.approx(0.2, rel=0.05)


def test_a_large_gap_is_filled_from_its_rim(atlas):
    """Half of the wall is dark, half bright; a hole in either takes the value around it, not a mixture of both."""
    x, y = atlas.position[:, 0], atlas.position[:, 1]
    rho = grey(np.where(x < 1.5, 0.2, 0.6))
    hole = (np.abs(y - 1.5) < 0.4) & ((np.abs(x - 0.6) < 0.4) | (np.abs(x - 2.4) < 0.4))
    spoilt = np.where(hole[:, None], np.float32(0), rho)
    result = run(atlas, spoilt, np.where(hole, NONE, GOOD))
    assert np.allclose(result[hole], rho[hole], rtol=0.02)
    assert np.abs(result[~hole] / rho[~hole] - 1).mean() < 0.02


def test_unmeasured_values_have_no_say(atlas):
    """Whatever stands where nothing was measured leaves no trace."""
    rho, gap = checks(atlas, 0.3), np.arange(len(atlas)) % 5 == 0
    error = np.where(gap, NONE, GOOD)
    one, other = (run(atlas, np.where(gap[:, None], np.float32(x), rho), error) for x in (0, 1))
    assert np.array_equal(one, other) and np.isfinite(one).all()


@pytest.mark.parametrize("known", [1, 2, 5])
def test_a_handful_of_measurements_is_enough(atlas, known):
    error = np.full(len(atlas), NONE)
    error[:: len(atlas) // known][:known] = POOR
    error[np.flatnonzero(np.isfinite(error))[known:]] = NONE
    assert np.allclose(run(atlas, np.full((len(atlas), 3), 0.3), error), 0.3, rtol=1e-5)


def test_a_large_object_is_thinned_reproducibly():
    large = make_room([quad((0, 0, 0), (4, 0, 0), (0, 4, 0), 0)], 0.04).atlas
    assert len(large) > 8000
    rho, error = checks(large, 0.5), np.where(np.arange(len(large)) % 7 == 0, POOR, GOOD)
    one, other = run(large, rho, error), run(large, rho, error)
    assert np.array_equal(one, other)
    assert np.median(np.abs(one / rho - 1)) < 0.02


def observed(median, spread, count, tier) -> LitDiffuse:
    """One element for each entry; `spread`: standard deviation relative to the median."""
    median, spread, count, tier = np.broadcast_arrays(median, spread, count, tier)
    L, between = grey(np.atleast_1d(median)), grey(np.atleast_1d(1.35 * median * spread))
    count, tier = np.atleast_1d(count).astype(np.int32), np.atleast_1d(tier).astype(np.int8)
    return LitDiffuse(L, between, count, tier, np.zeros(len(count), np.float32))


def of_one(lit: LitDiffuse) -> np.ndarray:
    """The relative error of elements that all belong to one object."""
    return relative_error(lit, np.zeros(len(lit.count), np.int32))


def test_doubt_falls_with_observations_and_rises_with_spread():
    by_count = of_one(observed(5.0, 0.3, [3, 10, 100], CLEAN))
    assert (np.diff(by_count) < 0).all()
    assert by_count[1] == pytest.approx(np.hypot(1.25 * 0.3 / np.sqrt(10), PRIOR.least_error), rel=1e-3)
    by_spread = of_one(observed(5.0, [0.01, 0.3, 1.0], 10, CLEAN))
    assert (np.diff(by_spread) > 0).all() and by_spread[0] < LEVELS.sure
    assert np.allclose(of_one(observed(5e-3, 0.3, 10, CLEAN)), of_one(observed(5e3, 0.3, 10, CLEAN)))


def test_one_or_two_observations_are_no_certainty():
    """Their quartiles coincide, which is no sign of agreement."""
    few = of_one(observed(1.0, 0.0, [1, 2, 3], CLEAN))
    assert few[0] == pytest.approx(np.hypot(1.25 * PRIOR.single, PRIOR.least_error)) and LEVELS.sure < few[1] < few[0]
    assert few[2] == pytest.approx(PRIOR.least_error)


@pytest.mark.parametrize("spread", [0.0, 0.08, 0.5])
def test_a_single_observation_is_as_unsure_as_the_object_s_others(spread):
    """Within bounds; what is known of one object says nothing of another."""
    lit = observed(1.0, [spread] * 40 + [0.0, 0.0], [20] * 40 + [1, 1], CLEAN)
    own, other = relative_error(lit, np.int32([7] * 41 + [2]))[-2:]
    expected = min(PRIOR.single_factor * spread, PRIOR.single)
    assert own == pytest.approx(np.hypot(1.25 * expected, PRIOR.least_error), rel=0.01)
    assert other == pytest.approx(np.hypot(1.25 * PRIOR.single, PRIOR.least_error))


def test_edges_and_saturation_are_in_doubt():
    clean, edge, saturated = of_one(observed(1.0, 0.1, 20, [CLEAN, EDGE, SATURATED]))
    assert edge == pytest.approx(clean + PRIOR.single) and saturated > edge > LEVELS.sure > clean


def test_what_nobody_saw_is_no_measurement():
    assert np.isinf(of_one(observed(np.nan, 0.0, [0, 0], -1))).all()


def test_fill_steadies_each_object_by_itself():
    """Two walls, dark and bright, side by side: the doubtful strip of either keeps to its own."""
    atlas = make_room([quad((i, 0, 0), (1, 0, 0), (0, 1, 0), i) for i in range(2)], 0.04).atlas
    rho = grey(np.where(atlas.object_id == 0, 0.1, 0.8))
    strip = np.abs(atlas.position[:, 0] - 1) < 0.1
    mixed = np.where(strip[:, None], np.float32(0.4), rho)
    valid = np.ones(len(atlas), bool)
    result = fill(atlas, mixed, valid, {}, set(), np.where(strip, POOR, GOOD).astype(np.float32))
    assert np.allclose(result.rho[strip], rho[strip], rtol=0.1)
    assert (result.origin == MEASURED).all()
    again = fill(atlas, mixed, ~strip, {}, set(), np.full(len(atlas), GOOD, np.float32))
    assert np.allclose(again.rho[strip], rho[strip], rtol=0.02) and (again.origin[strip] == FILLED).all()


def test_black_stays_black(atlas):
    result = run(atlas, np.zeros((len(atlas), 3)), np.full(len(atlas), GOOD))
    assert result.max() < 2e-3
