"""Observations kept one by one, target frames, and the specular part of a median."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.passes.specular.problems import pick
from addon.core.passes.specular.separate import grouped_median, specular_in_median, spread_over_object
from addon.core.scene import samples as module
from addon.core.scene.params import SAMPLES
from addon.core.scene.samples import SampleCollector, Samples, choose_elements
from addon.core.scene.visibility import CLEAN, EDGE, SATURATED, Observations
from tests.core.rooms import box_sides, make_room, quad


@pytest.fixture(scope="module")
def atlas():
    return make_room(box_sides(), 0.1).atlas


def test_chosen_elements_are_few_sorted_and_the_same_again(atlas, monkeypatch):
    monkeypatch.setattr(module, "SAMPLES", replace(SAMPLES, in_all=1536))
    chosen = choose_elements(atlas, 0)
    assert (np.diff(chosen) > 0).all() and np.array_equal(chosen, choose_elements(atlas, 0))
    assert np.array_equal(np.bincount(atlas.object_id[chosen]), [256] * 6)
    assert not np.array_equal(chosen, choose_elements(atlas, 1))
    floor = chosen[atlas.object_id[chosen] == 0]
    assert np.allclose(atlas.position[floor].mean(0), (2, 1.5, 0), atol=0.25)  # spread out
    monkeypatch.setattr(module, "SAMPLES", replace(SAMPLES, in_all=500))
    assert len(choose_elements(atlas, 0)) <= 500


def test_small_objects_are_kept_whole(atlas):
    assert np.array_equal(choose_elements(atlas, 0), np.arange(len(atlas)))


def seen(elements, tiers, value=1.0) -> Observations:
    n = len(elements)
    direction = np.tile(np.float32([0, 0, 1]), (n, 1))
    return Observations(
        np.asarray(elements, np.int32), np.full((n, 3), value, np.float32), np.asarray(tiers, np.int8), direction
    )


def test_what_is_collected(atlas):
    """Frames in any order; depth edges are left out, saturated ones marked; sorted by element, then frame."""
    collector = SampleCollector(atlas, 3, 0)
    collector.add(2, seen([4, 5, 6], [CLEAN, EDGE, SATURATED], 2))
    collector.add(0, seen([4, 6], [CLEAN, CLEAN], 0.5))
    collector.add(1, seen([], []))
    found = collector.result()
    assert found.element.tolist() == [4, 4, 6, 6] and found.frame.tolist() == [0, 2, 0, 2]
    assert found.saturated.tolist() == [False, False, False, True]
    assert found.radiance[:, 0].tolist() == [0.5, 2, 0.5, 2]


def test_many_frames_are_thinned(atlas, monkeypatch):
    monkeypatch.setattr(module, "SAMPLES", replace(SAMPLES, frames=10))
    collectors = [SampleCollector(atlas, 100, 0) for _ in range(2)]
    frames = list(range(100))
    for collector, order in zip(collectors, (frames, frames[::-1]), strict=True):
        for frame in order:
            collector.add(frame, seen(np.arange(100), np.full(100, CLEAN)))
    one, other = (collector.result() for collector in collectors)
    assert 800 < len(one.element) < 1200
    assert np.array_equal(one.element, other.element) and np.array_equal(one.frame, other.frame)


def grid_samples(elements: int, frames: int) -> Samples:
    m = elements * frames
    return Samples(
        np.repeat(np.arange(elements), frames).astype(np.int32), np.tile(np.arange(frames), elements).astype(np.int32),
        np.ones((m, 3), np.float32), np.tile(np.float32([0, 0, 1]), (m, 1)), np.zeros(m, bool), np.zeros(m, np.float32),
    )  # fmt: skip


def test_pick_is_bounded_sorted_and_the_same_again():
    samples = grid_samples(50, 20)
    some = np.arange(200, 1000)
    index = pick(samples, some, 10, 5, 4, 0)
    assert len(index) == 50 and (np.diff(index) > 0).all() and np.isin(index, some).all()
    count = np.bincount(samples.element[index])
    assert set(count[count > 0]) == {5} and (count > 0).sum() == 10
    assert np.array_equal(index, pick(samples, some, 10, 5, 4, 0))
    assert len(pick(samples, some[:3], 10, 5, 4, 0)) == 0  # too few views
    assert len(pick(samples, some[:0], 10, 5, 4, 0)) == 0


def test_grouped_median_is_numpys():
    rng = np.random.default_rng(0)
    group = np.sort(rng.integers(0, 40, 300)) * 3
    values = rng.lognormal(0, 1, (300, 3)).astype(np.float32)
    names, found = grouped_median(values, group)
    assert np.array_equal(names, np.unique(group))
    assert np.allclose(found, [np.median(values[group == name], 0) for name in names], rtol=1e-6)


def test_the_specular_part_of_a_median():
    samples = grid_samples(4, 9)
    rng = np.random.default_rng(0)
    lobe = rng.uniform(0, 0.5, (36, 3)).astype(np.float32)
    diffuse = np.repeat(np.float32([0.1, 0.3, 1, 0.0]), 9)[:, None]
    shown = replace(samples, radiance=diffuse + lobe)
    chosen = np.flatnonzero(samples.element != 2)
    element, part = specular_in_median(shown, chosen, lobe[chosen])
    assert element.tolist() == [0, 1, 3]
    for i, one in enumerate(element):
        own = samples.element == one
        whole = np.median(shown.radiance[own], 0)
        assert np.allclose(part[i], whole - diffuse[own][0], atol=1e-6)
        assert (part[i] >= 0).all() and (part[i] <= whole + 1e-6).all()
    # a lobe brighter than anything that was seen can't leave less than black
    _, all_of_it = specular_in_median(shown, chosen, 10 + lobe[chosen])
    assert np.allclose(all_of_it[0], np.median(shown.radiance[:9], 0))


def test_spreading_over_an_object():
    """Known values stay near themselves, what lies between is between, the other side of a board is not asked."""
    room = make_room([quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0), quad((0, 0, 0.01), (0, 1, 0), (1, 0, 0), 0)], 0.025)
    atlas = room.atlas
    own = np.arange(len(atlas))
    up = atlas.normal[:, 2] > 0
    truth = np.where(up, 1 + atlas.position[:, 0], 5)[:, None].repeat(3, 1).astype(np.float32)
    known = np.sort(np.random.default_rng(0).choice(own, 1200, replace=False))
    found = spread_over_object(atlas, own, known, truth[known])
    assert np.abs(found - truth)[up].max() < 0.15 and np.allclose(found[~up], 5, atol=1e-4)
    noise = np.random.default_rng(1).normal(0, 0.5, (len(known), 3)).astype(np.float32)
    noisy = spread_over_object(atlas, own, known, truth[known] + noise)
    assert (noisy - found).std() < 0.5 * noise.std()  # each known value is noisy by itself
    one = spread_over_object(atlas, own, known[:1], truth[known[:1]])
    assert np.allclose(one, truth[known[0]])
