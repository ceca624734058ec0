"""The white balance that all frames have in common, of cameras that follow what they see, and of others."""

import numpy as np
import pytest

from addon.core.passes.radiometric_calibration.white_balance import mean_white_balance

FRAMES = 96
WARM = np.array([0.35, 0.0, -0.35])
ALL = np.ones(FRAMES, bool)


def walk(rng, cast=WARM):
    """Log mean colour of what a moving camera sees: a room's, and from frame to frame another's."""
    steps = rng.normal(0, 0.05, (FRAMES, 3))
    return cast + np.cumsum(steps - steps.mean(1, keepdims=True), 0) * np.exp(-np.arange(FRAMES) / 200)[:, None]


def balanced(seen, strength, rate):
    """Log white balance of a camera that takes a share of the colour out, slowly."""
    result, state = np.empty_like(seen), seen[0]
    for i, one in enumerate(seen):
        state = state + rate * (one - state) if i else one
        result[i] = -strength * state
    return result


def shown(rng, seen, balance):
    """What calibration knows: gains of mean 1 with noise, and pictures' mean colours."""
    gain = balance - balance.mean(0) + rng.normal(0, 0.005, balance.shape) + rng.normal(0, 0.5, (FRAMES, 1))
    return gain, seen + balance


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("strength, rate", [(0.6, 0.15), (0.4, 1.0), (0.7, 0.3)])
def test_a_camera_that_follows_what_it_sees_tells_what_it_took_out(seed, strength, rate):
    rng = np.random.default_rng(seed)
    seen = walk(rng)
    balance = balanced(seen, strength, rate)
    true = balance.mean(0) - balance.mean()
    found = mean_white_balance(*shown(rng, seen, balance), ALL)
    assert abs(found.mean()) < 1e-9
    assert np.abs(found - true).max() < 0.4 * np.abs(true).max()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_locked_white_balance_stays(seed):
    rng = np.random.default_rng(seed)
    seen = walk(rng)
    found = mean_white_balance(*shown(rng, seen, np.zeros_like(seen)), ALL)
    assert np.abs(found).max() < 0.03


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_camera_that_takes_all_of_the_colour_out_tells_nothing(seed):
    rng = np.random.default_rng(seed)
    seen = walk(rng)
    found = mean_white_balance(*shown(rng, seen, balanced(seen, 1.0, 0.3)), ALL)
    assert np.abs(found).max() < 0.1


def test_too_few_frames_tell_nothing():
    rng = np.random.default_rng(0)
    seen = walk(rng)
    gain, mean = shown(rng, seen, balanced(seen, 0.6, 0.15))
    assert not mean_white_balance(gain, mean, np.arange(FRAMES) < 2).any()
    assert not mean_white_balance(gain[:1], mean[:1], ALL[:1]).any()
