"""Texture carried into what was not measured: patterns go on, and nothing is made up where there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.passes.texture_fill.synthesis import (
    autocovariance,
    dominant_offsets,
    scale_of,
    smooth_mean,
    typical_contrast,
)
from addon.core.passes.texture_fill.texture_fill import texture_of
from tests.core.rooms import box_sides, make_room

FLOOR, TEXEL = 0, 0.02


@pytest.fixture(scope="module")
def room():
    return make_room(box_sides(), TEXEL)


def checker(position: np.ndarray) -> np.ndarray:
    """Tiles of .3 m, light and dark, (n, 3) float32."""
    light = np.floor(position[:, :2] / 0.3).astype(int).sum(1) % 2 > 0
    return np.where(light[:, None], (0.6, 0.55, 0.5), (0.12, 0.1, 0.1)).astype(np.float32)


def planks(position: np.ndarray) -> np.ndarray:
    """Boards .12 m wide along y, each of a tone of its own, with grain along them."""
    board = np.floor(position[:, 0] / 0.12).astype(int)
    tone = np.random.default_rng(3).uniform(0.6, 1.4, 64)[board % 64]
    grain = 1 + 0.2 * np.sin(2 * np.pi * position[:, 0] / 0.04)
    return ((tone * grain)[:, None] * (0.3, 0.2, 0.12)).astype(np.float32)


def hole_in(atlas, low=(1.2, 0.9), high=(2.4, 1.9)) -> np.ndarray:
    at = atlas.position[:, :2]
    return (atlas.object_id == FLOOR) & (at > low).all(1) & (at < high).all(1)


def filled(room, pattern, hole, noise=0.0, error=0.06):
    """What is found for a floor with a pattern, and the image over the atlas that shows it; 0 where nothing is."""
    atlas = room.atlas
    rho = np.full((len(atlas), 3), 0.5, np.float32)
    floor = atlas.object_id == FLOOR
    rho[floor] = pattern(atlas.position[floor])
    rho *= np.exp(noise * np.random.default_rng(0).normal(size=rho.shape)).astype(np.float32)
    rho[hole] = np.median(rho[floor & ~hole], 0)
    found = texture_of(atlas, room.mesh, rho, ~hole, hole, np.full(len(atlas), error, np.float32))
    image = np.zeros((atlas.size * atlas.size, 3), np.float32)
    image[found.texel] = found.rho
    return found, image[atlas.texel[hole]], rho[hole]


def test_tiles_go_on_as_they_lie(room):
    hole = hole_in(room.atlas)
    found, shown, plain = filled(room, checker, hole)
    true = checker(room.atlas.position[hole])
    off = np.abs(shown - true).mean(1)
    assert np.mean(off < 0.1) > 0.95 and np.mean(np.square(shown - true)) < 0.1 * np.mean(np.square(plain - true))
    # Nothing but what was missing is touched, its island's border apart.
    assert hole[room.atlas.padding[found.texel]].all()


def test_boards_keep_their_direction_and_contrast(room):
    hole = hole_in(room.atlas)
    _, shown, _ = filled(room, planks, hole)
    at = np.floor((room.atlas.position[hole, :2] - (1.2, 0.9)) / TEXEL).astype(int)
    picture = np.zeros((*(at.max(0) + 1), 3))
    picture[tuple(at.T)] = shown
    across, along = (np.abs(np.diff(picture.mean(2), axis=axis)).mean() for axis in (0, 1))
    assert along < 0.3 * across
    true = planks(room.atlas.position[(room.atlas.object_id == FLOOR) & ~hole])
    assert np.std(shown.mean(1)) == pytest.approx(np.std(true.mean(1)), rel=0.3)
    assert np.allclose(shown.mean(0), true.mean(0), rtol=0.12)


def test_what_stands_at_the_rim_is_not_copied(room):
    """A hearth in a floor's plane, by the wall and beside the hole, has no boards."""
    at = room.atlas.position[:, :2]
    hole = hole_in(room.atlas)
    hearth = ((at > (2.4, 0.9)) & (at < (2.8, 1.9))).all(1) | (at[:, 0] < 0.3)

    def floor(position):
        mine = np.where(hearth[room.atlas.object_id == FLOOR][:, None], (0.02, 0.03, 0.3), planks(position))
        return mine.astype(np.float32)

    found, shown, _ = filled(room, floor, hole)
    assert len(found.texel) and shown.any(1).all()
    assert (shown[:, 2] < shown[:, 0]).mean() > 0.99


def test_a_rare_dark_tile_is_copied(room):
    """One tile of ten is dark: more than three deviations from the usual one, and yet of the floor."""

    def tiles(position):
        at = np.floor(position[:, :2] / 0.12).astype(int)
        dark = (at[:, 0] + 3 * at[:, 1]) % 10 == 0
        grain = 0.5 + 0.03 * np.sin(2 * np.pi * position[:, :1] / 0.04)
        return (grain * np.where(dark[:, None], 0.2, 1.0) * np.ones(3)).astype(np.float32)

    hole = hole_in(room.atlas)
    _, shown, _ = filled(room, tiles, hole, error=0.03)
    assert np.mean(shown.mean(1) < 0.25) == pytest.approx(0.1, abs=0.04)


def test_colour_that_varies_slowly_is_not_copied(room):
    """Light tiles that get darker across the room: the copies take the level of where they are put."""

    def darker(position):
        return checker(position) * (1.2 - 0.2 * position[:, :1]).astype(np.float32)

    hole = hole_in(room.atlas)
    _, shown, _ = filled(room, darker, hole)
    true = darker(room.atlas.position[hole])
    light = true.mean(1) > 0.25
    assert np.median(np.abs(shown[light] / true[light] - 1)) < 0.1


@pytest.mark.parametrize("noise", [0.0, 0.08])
def test_nothing_is_made_up_on_an_even_floor(room, noise):
    """Noise below the error that is told of it is no texture."""
    found, _, _ = filled(room, lambda at: np.full((len(at), 3), 0.4, np.float32), hole_in(room.atlas), noise, error=0.1)
    assert len(found.texel) == 0


def test_a_measured_corner_is_not_enough(room):
    at = room.atlas.position[:, :2]
    found, _, _ = filled(room, checker, (room.atlas.object_id == FLOOR) & (at > 0.7).any(1))
    assert len(found.texel) == 0


def test_a_wall_is_no_source_for_the_floor(room):
    """One object of two planes: what lies across the edge has another texture."""
    atlas = room.atlas
    rho, hole = planks(atlas.position), atlas.object_id == FLOOR
    found = texture_of(atlas, room.mesh, rho, ~hole, hole, np.full(len(atlas), 0.06, np.float32))
    assert len(found.texel) == 0


def test_triangles_far_smaller_than_texels_are_left_as_they_are(room):
    """As crumbs of a fine mesh, which share texels: nothing is laid out flat."""
    hole = hole_in(room.atlas)
    rho = checker(room.atlas.position)
    tiny = replace(room.atlas, uv=room.atlas.uv * np.float32(1e-4))
    found = texture_of(tiny, room.mesh, rho, ~hole, hole, np.full(len(rho), 0.06, np.float32))
    assert len(found.texel) == 0


def test_offsets_are_the_patterns_periods():
    rows, columns = np.mgrid[:120, :140]
    picture = np.where((rows // 10 + columns // 15) % 2 > 0, 1.0, -1.0).astype(np.float32)[..., None]
    hole = np.zeros(picture.shape[:2], bool)
    hole[50:80, 50:90] = True
    covariance, overlap = autocovariance(picture, ~hole)
    scale = scale_of(covariance, overlap)
    assert 2 < scale < 10
    offsets = dominant_offsets(picture, ~hole, hole, 2 * scale)
    exact = [i % 20 == 0 and j % 30 == 0 or i % 20 == 10 and j % 30 == 15 for i, j in offsets]
    assert len(offsets) > 4 and all(exact[:4])


def test_contrast_is_what_most_of_a_picture_has():
    rows, columns = np.mgrid[:200, :200]
    tiles = np.where((rows // 10 + columns // 10) % 2 > 0, 0.3, -0.3).astype(np.float32)[..., None]
    everywhere = np.ones((200, 200), bool)
    assert typical_contrast(tiles, everywhere, 40) == pytest.approx(0.3, rel=0.15)
    stain = np.where(rows < 50, 1.0, 0.0).astype(np.float32)[..., None] * tiles
    noise = 0.3 * np.random.default_rng(1).normal(size=(200, 200, 1)).astype(np.float32)
    for picture in (stain, noise):
        assert typical_contrast(picture, everywhere, 40) < 0.03


def test_the_slow_part_is_carried_on():
    """A gradient's mean far inside a hole stays between what is known at its ends."""
    picture = np.linspace(1, 2, 200, dtype=np.float32)[None, :, None] * np.ones((60, 1, 1), np.float32)
    known = np.ones((60, 200), bool)
    known[:, 60:140] = False
    smooth = smooth_mean(picture, known, 8.0)[..., 0]
    assert np.abs(smooth - picture[..., 0])[known].max() < 0.06
    assert np.abs(np.diff(smooth[30])).max() < 0.02 and 1.2 < smooth[30, 60:140].min() < smooth[30, 60:140].max() < 1.8
