"""What E's error leaves in an object's albedo: what goes, and what an artist painted there stays."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from addon.core.passes.albedo.bias_field import without_bias
from tests.core.rooms import make_room, quad

SIDE, TEXEL = 3.0, 0.025
LEVEL = np.array([0.5, 0.4, 0.3])


@pytest.fixture(scope="module")
def room():
    """Floor and wall of 3 m: two objects, 28,800 elements."""
    return make_room(
        [quad((0, 0, 0), (SIDE, 0, 0), (0, SIDE, 0), 0), quad((0, 0, 0), (0, SIDE, 0), (0, 0, SIDE), 1)], TEXEL
    )


@pytest.fixture(scope="module")
def atlas(room):
    return room.atlas


def halo(atlas, strength=0.4, size=0.6):
    """Log of a smooth error: light that is missing around a lamp in the corner, and too much elsewhere."""
    distance = np.linalg.norm(atlas.position - [0, SIDE / 2, 0.5], axis=1)
    return strength * np.exp(-((distance / size) ** 2))[:, None]


def run(atlas, rho, measured=None):
    every = np.ones(len(atlas), bool)
    return without_bias(atlas, rho.astype(np.float32), every if measured is None else measured)


def painted(atlas, colour=LEVEL, noise=0.05):
    grain = np.random.default_rng(0).normal(0, noise, (len(atlas), 1))
    return np.asarray(colour) * np.exp(grain) * np.ones((len(atlas), 3))


def error(found, truth):
    """Root mean square of log albedo's error, around its median."""
    off = np.log(found / truth).mean(1)
    return float(np.sqrt(np.mean(np.square(off - np.median(off)))))


def test_a_halo_on_an_even_wall_goes(atlas):
    truth = painted(atlas)
    spoilt = truth * np.exp(halo(atlas))
    assert error(run(atlas, spoilt), truth) < error(spoilt, truth) / 3


def test_a_coloured_halo_goes(atlas):
    """A lamp of another colour than the room's light."""
    truth = painted(atlas)
    spoilt = truth * np.exp(halo(atlas) * [1, 0, -1])
    left = np.log(run(atlas, spoilt) / truth)
    assert left[:, [0, 2]].std(0).max() < np.log(spoilt / truth)[:, [0, 2]].std(0).max() / 3


def test_an_even_wall_stays_as_it_is(atlas):
    truth = painted(atlas)
    assert np.abs(np.log(run(atlas, truth) / truth)).max() < 0.03


def test_the_level_stays(atlas):
    """What all of an object has in common is not told by it."""
    truth = painted(atlas) * np.where(atlas.object_id[:, None] == 0, 1.3, 0.6)
    found = run(atlas, truth * np.exp(halo(atlas)))
    for own in (atlas.object_id == 0, atlas.object_id == 1):
        assert np.median(found[own] / truth[own]) == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize(("size", "less"), [(0.1, 2), (0.5, 2), (1.5, 1.5)])
def test_a_pattern_keeps_its_contrast(atlas, size, less):
    """Stripes, a third as bright, of the width of a tile to that of half a floor; a wide one hides half of the halo."""
    dark = atlas.position[:, 1] % size < 0.4 * size
    truth = painted(atlas) * np.where(dark[:, None], 1 / 3, 1)
    spoilt = truth * np.exp(halo(atlas))
    found = run(atlas, spoilt)
    assert error(found, truth) < error(spoilt, truth) / less
    contrast = np.median(found[~dark] / truth[~dark]) / np.median(found[dark] / truth[dark])
    assert contrast == pytest.approx(1, abs=0.05)


def test_fine_texture_stays(atlas):
    """Grain of a few centimetres, as of wood."""
    noise = np.random.default_rng(1).normal(0, 1, (120, 120))
    grain = gaussian_filter(noise, 0.7, mode="wrap")
    at = (atlas.position[:, :2] / TEXEL).astype(int) % 120
    truth = LEVEL * np.exp(0.15 * grain[at[:, 0], at[:, 1]] / grain.std())[:, None]
    floor = atlas.object_id == 0
    found = np.log(run(atlas, truth) / truth)[floor].mean(1)
    assert found.std() < 0.15 / 4


def test_a_pale_spot_of_another_hue_is_no_error(atlas):
    """As bright as the wall: a child's drawing, not a lamp."""
    spot = np.linalg.norm(atlas.position - [0, SIDE / 2, 1.5], axis=1) < 0.5
    truth = painted(atlas) * np.where(spot[:, None], [0.5, 1.0, 1.6], 1)
    found = run(atlas, truth)
    assert np.median(found[spot] / truth[spot], 0) == pytest.approx(np.ones(3), abs=0.1)


def test_the_sides_of_a_thin_board_have_errors_of_their_own(atlas):
    """Lit from above, its lower side is bright by an error alone."""
    board = make_room(
        [quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0), quad((0, 0, -0.02), (0, 1, 0), (1, 0, 0), 0)], 0.02
    ).atlas
    up = board.normal[:, 2] > 0
    assert 0.4 < up.mean() < 0.6
    truth = painted(board)
    spot = np.exp(-np.square(board.position[:, :2] - 0.5).sum(1) / 0.08)[:, None]
    spoilt = truth * np.exp(np.where(up[:, None], 0.4, -0.4) * spot)
    found = run(board, spoilt)
    for side in (up, ~up):
        assert error(found[side], truth[side]) < error(spoilt[side], truth[side]) / 2


def test_what_was_not_measured_is_left(atlas):
    measured = np.random.default_rng(0).random(len(atlas)) < 0.5
    rho = painted(atlas) * np.exp(halo(atlas))
    rho[~measured] = np.nan
    found = run(atlas, rho, measured)
    assert np.isnan(found[~measured]).all() and np.isfinite(found[measured]).all()
    whole = run(atlas, painted(atlas) * np.exp(halo(atlas)))
    assert np.median(np.abs(np.log(found[measured] / whole[measured]))) < 0.03


@pytest.mark.parametrize("unit", [0.001, 1000.0])
def test_the_unit_of_length_does_not_matter(atlas, unit):
    rho = painted(atlas) * np.exp(halo(atlas))
    scaled = replace(atlas, position=atlas.position * np.float32(unit), area=atlas.area * np.float32(unit**2))
    assert run(scaled, rho) == pytest.approx(run(atlas, rho), rel=1e-3)


def test_a_black_channel_is_no_number_out_of_range(atlas):
    rho = painted(atlas, [0.5, 0.2, 0.0])
    found = run(atlas, rho)
    assert np.isfinite(found).all() and (found[:, 2] == 0).all()


def test_a_few_elements_are_left_alone(atlas):
    measured = np.arange(len(atlas)) < 20
    rho = painted(atlas).astype(np.float32)
    assert np.array_equal(run(atlas, rho, measured), rho)


def test_a_huge_ground_needs_no_huge_grid(atlas):
    """A thousand times as wide as the area that was measured tells: cells grow."""
    wide = replace(atlas, position=atlas.position * np.float32(1000))
    rho = painted(atlas) * np.exp(halo(atlas))
    tracemalloc.start()
    found = run(wide, rho)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.isfinite(found).all() and peak < 300e6
