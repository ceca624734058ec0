"""Texel blocks: linear quantities come out exact, edges and islands are kept apart, few texels are asked."""

from __future__ import annotations

import numpy as np

from addon.core.light.texel_blocks import TexelBlocks
from tests.core.rooms import box_sides, make_room, quad


def asking(atlas, value):
    """A function for `evaluate` that counts which elements it was asked for."""
    asked = np.zeros(len(atlas), int)

    def function(index):
        asked[index] += 1
        return value[index]

    return function, asked


def test_a_linear_quantity_is_exact_from_a_share_of_the_texels():
    atlas = make_room([quad((0, 0, 0), (4, 0, 0), (0, 3, 0), 0)], 0.05).atlas
    value = (atlas.position @ np.float32([[1, 0, 0], [0, 1, 0], [1, 1, 0]]) + 1).astype(np.float32)
    function, asked = asking(atlas, value)
    found = TexelBlocks(atlas, np.arange(len(atlas))).evaluate(function, 4, 0.5)
    assert np.allclose(found, value, atol=1e-4)
    assert asked.max() == 1
    assert asked.mean() < 0.25


def test_edges_are_asked_for_texel_by_texel():
    atlas = make_room([quad((0, 0, 0), (4, 0, 0), (0, 3, 0), 0)], 0.05).atlas
    value = np.where(atlas.position[:, :1] < 2.013, np.float32(1), np.float32(3)).repeat(3, 1)
    function, asked = asking(atlas, value)
    found = TexelBlocks(atlas, np.arange(len(atlas))).evaluate(function, 8, 0.05)
    assert np.array_equal(found, value)
    away = np.abs(atlas.position[:, 0] - 2.013) > 0.5
    assert asked[away].mean() < 0.2 and asked[np.abs(atlas.position[:, 0] - 2.013) < 0.1].mean() > 0.5


def test_a_base_hides_small_changes():
    atlas = make_room([quad((0, 0, 0), (4, 0, 0), (0, 3, 0), 0)], 0.05).atlas
    value = np.where(atlas.position[:, :1] < 2.013, np.float32(1), np.float32(1.2)).repeat(3, 1)
    blocks = TexelBlocks(atlas, np.arange(len(atlas)))
    alone, with_base = asking(atlas, value), asking(atlas, value)
    blocks.evaluate(alone[0], 4, 0.05)
    blocks.evaluate(with_base[0], 4, 0.05, np.full(len(atlas), 100, np.float32))
    assert with_base[1].sum() < alone[1].sum()


def test_walls_do_not_mix():
    """Each wall has its own value; no texel takes anything from another wall's island."""
    atlas = make_room(box_sides(), 0.1).atlas
    value = (atlas.object_id[:, None] + np.float32([1, 2, 3])).astype(np.float32)
    function, asked = asking(atlas, value)
    found = TexelBlocks(atlas, np.arange(len(atlas))).evaluate(function, 4, np.inf)
    assert np.allclose(found, value, atol=1e-5)
    assert asked.mean() < 0.6


def test_part_of_the_elements_and_none():
    atlas = make_room(box_sides(), 0.2).atlas
    some = np.flatnonzero(atlas.object_id == 2)
    value = atlas.position.copy()
    found = TexelBlocks(atlas, some).evaluate(lambda i: value[some][i], 2, np.inf)
    assert np.allclose(found, value[some], atol=1e-4)
    assert TexelBlocks(atlas, some[:0]).evaluate(lambda i: value[i], 2, 0.1).shape == (0, 3)


def test_step_one_asks_for_everything():
    atlas = make_room(box_sides(), 0.3).atlas
    function, asked = asking(atlas, atlas.normal)
    found = TexelBlocks(atlas, np.arange(len(atlas))).evaluate(function, 1, 0.1)
    assert (asked == 1).all() and np.array_equal(found, atlas.normal)
