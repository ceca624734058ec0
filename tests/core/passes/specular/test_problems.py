"""Observations made into a problem: those whose reflected light comes out noisy get more rays."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.lobes import GRID, LobeLight
from addon.core.passes.specular import problems
from addon.core.passes.specular.problems import AGAIN, Problems
from addon.core.scene.samples import Samples
from tests.core.rooms import box_sides, make_room

RAYS, COUNT = 32, 12
NOISY = np.array([2, 7])


@pytest.fixture
def asked(monkeypatch):
    """How many observations were asked for with how many rays; two of them are noisy with few."""
    asked = []

    def light(field, bright, element, direction, *, rays, grid=GRID, **how):
        asked.append((len(element), rays))
        shape = (len(element), len(grid), 3)
        noise = np.zeros(shape, np.float32)
        if rays == RAYS:
            noise[NOISY[NOISY < len(element)]] = 20.0
        return LobeLight(np.full(shape, rays, np.float32), np.zeros(shape, np.float32), noise, 0 * noise, grid)

    monkeypatch.setattr(problems, "reflected_light", light)
    return asked


@pytest.fixture
def maker():
    room = make_room(box_sides(), 0.5)
    n = len(room.atlas)
    one = np.ones((n, 3), np.float32)
    direction = np.tile(np.float32([0, 0, 1]), (COUNT, 1))
    samples = Samples(np.arange(COUNT, dtype=np.int32), np.zeros(COUNT, np.int32), one[:COUNT], direction,
                      np.zeros(COUNT, bool))  # fmt: skip
    return Problems(room.field(one), samples)


def test_noisy_ones_are_done_again(asked, maker):
    found = maker.problem(np.arange(COUNT), RAYS)
    assert asked == [(COUNT, RAYS), (len(NOISY), AGAIN * RAYS)]
    again = np.isin(np.arange(COUNT), NOISY)
    assert (found.light.A[again] == AGAIN * RAYS).all() and not found.light.A_noise[again].any()
    assert (found.light.A[~again] == RAYS).all()


def test_a_first_look_may_be_rough(asked, maker):
    maker.problem(np.arange(COUNT), RAYS, rough=True)
    assert asked == [(COUNT, RAYS)]


def test_what_is_sure_is_done_once(asked, maker):
    maker.problem(np.array([0, 1]), RAYS)
    assert asked == [(2, RAYS)]
