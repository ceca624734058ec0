"""Observations made into a problem: those whose reflected light comes out noisy get more rays."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.lobes import LobeLight
from addon.core.passes.specular.problems import Problems
from addon.core.scene.samples import Samples
from tests.core.rooms import box_sides, make_room

RAYS = 32


@pytest.fixture(scope="module")
def room():
    return make_room(box_sides(), 0.25)


@pytest.fixture(scope="module")
def even(room):
    return np.ones((len(room.atlas), 3), np.float32)


@pytest.fixture(scope="module")
def speckled(room, even):
    """Bright elements here and there, each met by a ray or two."""
    return even * np.where(np.random.default_rng(0).random(len(even)) < 0.01, 300, 1).astype(np.float32)[:, None]


def lights(room, radiance, *, without=()) -> LobeLight:
    """Of observations of radiance 1, all straight from above."""
    n = len(room.atlas)
    one = np.ones((n, 3), np.float32)
    direction = room.atlas.normal.astype(np.float32)
    samples = Samples(np.arange(n, dtype=np.int32), np.zeros(n, np.int32), one, direction, np.zeros(n, bool))
    made = Problems(room.field(radiance), samples, without=without)
    return made.light(np.arange(n), RAYS)


def noise(light: LobeLight) -> float:
    return float(np.sqrt((light.A_noise**2).mean()))


def test_noisy_ones_are_done_again(room, speckled):
    plain = lights(room, speckled, without=("more-rays",))
    found = lights(room, speckled)
    assert noise(found) < 0.6 * noise(plain)  # of eight times the rays
    same = (found.A == plain.A).all((1, 2))
    assert 0 < same.sum() < len(same)
    assert noise(plain.part(same)) < 0.2 * noise(plain.part(~same))


def test_what_is_sure_is_done_once(room, even):
    found, plain = lights(room, even), lights(room, even, without=("more-rays",))
    assert np.array_equal(found.A, plain.A)
