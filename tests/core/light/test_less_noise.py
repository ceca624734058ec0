"""Noise goes where light is smooth, and stays light at edges."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from addon.core.light.less_noise import less_noise
from addon.core.light.params import LESS_NOISE

SIDE, TEXEL = 100, 0.01


def wall(light, noise, seed=0):
    """A wall of 1 m with `light` ((k, k)) in all channels, with noise; positions, normals and both."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:SIDE, :SIDE] * TEXEL
    position = np.float32(np.stack([x.ravel(), np.full(x.size, 2.0), y.ravel()], 1))
    normal = np.broadcast_to(np.float32([0, 1, 0]), position.shape)
    clean = np.repeat(light.ravel()[:, None], 3, 1)
    seen = clean + rng.normal(0, noise, (clean.shape[0], 1))
    return position, normal, np.float32(clean), np.float32(seen), np.full(len(clean), noise, np.float32)


def error(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)))


def test_smooth_light_loses_its_noise():
    """A slope is no rest."""
    slope = 1 + 0.5 * np.mgrid[:SIDE, :SIDE][1] / SIDE
    position, normal, clean, seen, noise = wall(slope, 0.1)
    found, _ = less_noise(position, normal, seen, noise)
    assert error(found, clean) < 0.03 and error(seen, clean) > 0.09


def test_the_noise_that_there_was_is_told_evenly():
    """One place's own noise says little: its neighbours' count as well, those of another side of the room don't."""
    position, normal, _, seen, noise = wall(np.ones((SIDE, SIDE)), 0.1)
    single = np.where(np.arange(len(noise)) % 4 == 0, 2 * noise, 0)
    single[position[:, 0] > 0.5] = 0
    _, told = less_noise(position, normal, seen, single.astype(np.float32))
    np.testing.assert_allclose(told[position[:, 0] < 0.5 - LESS_NOISE.cell], 0.1, rtol=0.1)
    assert not told[position[:, 0] > 0.5 + LESS_NOISE.cell].any()


def test_a_shadows_edge_stays():
    half = np.where(np.mgrid[:SIDE, :SIDE][1] < 43, 1.0, 2.0)
    position, normal, clean, seen, noise = wall(half, 0.05)
    found, _ = less_noise(position, normal, seen, noise)
    beside = np.abs(position[:, 0] - 0.43) < LESS_NOISE.cell / 2
    assert error(found[beside], clean[beside]) < 0.06  # no more than the noise itself
    assert error(found[~beside], clean[~beside]) < 0.03


def test_memory_beside_the_result_is_a_portions():
    """A room of many cells: what is held at once for each element is less than the double planes of a grid would be."""
    rng = np.random.default_rng(0)
    position = rng.random((500_000, 3), np.float32) * 5
    position[:, 2] = 0
    light, normal = np.ones_like(position), np.broadcast_to(np.float32([0, 0, 1]), position.shape)
    tracemalloc.start()
    less_noise(position, normal, light, light[:, 0], threads=2)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 120 * len(position)


def test_without_noise_nothing_changes():
    rng = np.random.default_rng(1)
    position, normal, clean, _, _ = wall(rng.random((SIDE, SIDE)), 0)
    found, told = less_noise(position, normal, clean, np.zeros(len(clean), np.float32))
    np.testing.assert_allclose(found, clean, atol=1e-5)
    assert not told.any()


@pytest.mark.parametrize("count", [1, 5])
def test_too_few_to_tell(count):
    position, normal, _, seen, noise = (x[:count] for x in wall(np.ones((SIDE, SIDE)), 0.1))
    found, told = less_noise(position, normal, seen, noise)
    np.testing.assert_allclose(found, seen, atol=1e-6)
    np.testing.assert_allclose(told, noise, rtol=1e-5)


def test_two_sides_of_a_sheet_are_told_apart():
    position, normal, _, _, _ = wall(np.ones((SIDE, SIDE)), 0)
    front = np.arange(len(position)) % 2 == 0
    normal = np.where(front[:, None], normal, -normal)
    light = np.repeat(np.where(front, 1.0, 3.0)[:, None], 3, 1).astype(np.float32)
    found, _ = less_noise(position, normal, light, np.full(len(light), 1.0, np.float32))
    np.testing.assert_allclose(found, light, atol=1e-4)
