"""Parts of the sky of which no frame tells the radiance."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.light_fit import Sample
from addon.core.passes.unseen_light.sky import Sky
from addon.core.passes.unseen_light.unseen_lamps import solve_sky

M = 600
BASE = np.random.default_rng(4).uniform(0.4, 1.6, (M, 1)) * np.ones(3)
SHOWN = np.random.default_rng(5).uniform(0, 1, M) ** 3
"""E of the part, which is all that it gives somewhere and nothing elsewhere."""
GUESS = np.array([2.0, 2.5, 2.9])


def solved(true: np.ndarray, share: float, clipped: bool) -> Sky:
    """What is found of a part of the sky that gives `share` of E at radiance 1."""
    rng = np.random.default_rng(6)
    G = share * SHOWN / SHOWN.mean()
    albedo = np.array([0.2, 0.5, 0.7, 0.4])[np.arange(M) % 4] * np.exp(rng.normal(0, 0.02, M))
    received = BASE + G[:, None] * true
    sample = Sample(np.arange(M), np.arange(M) % 4, albedo[:, None] * received, BASE)
    sky = Sky([G], [GUESS], [clipped], [True])
    solve_sky(sample, [], {}, sky, BASE)
    return sky


def test_a_clipped_part_that_lights_the_room_is_solved_for():
    sky = solved(4 * GUESS, 0.1, True)
    assert sky.radiance[0] == pytest.approx(4 * GUESS, rel=0.05) and sky.solved == {0}


def test_a_clipped_part_is_no_darker_than_it_was_seen():
    sky = solved(0.5 * GUESS, 0.1, True)
    assert sky.radiance[0].tolist() == GUESS.tolist() and not sky.solved and not sky.notes()


@pytest.mark.parametrize("clipped", [False, True])
def test_a_part_that_gives_next_to_nothing_stays_as_it_was_seen(clipped):
    """Even the least radiance that is tried, .7 % of all light, explains worse than what frames show."""
    sky = solved(GUESS, 3e-4, clipped)
    assert sky.radiance[0] == pytest.approx(GUESS, rel=0.3)
