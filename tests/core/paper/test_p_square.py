"""P-square against its article and against the exact median of streams."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.paper.p_square import PSquare


def over(x: np.ndarray):
    """P-square's summary of a stream, (observations, elements, 3)."""
    p2, every = PSquare(x.shape[1]), np.arange(x.shape[1], dtype=np.int32)
    for values in x:
        p2.add(every, values)
    return p2.result()


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_few_observations_are_exact(n):
    x = np.random.default_rng(n).random((n, 50, 3), np.float32)
    found = over(x)
    for got, share in ((found.lower, 0.25), (found.median, 0.5), (found.upper, 0.75)):
        assert np.allclose(got, np.quantile(x, share, axis=0), rtol=1e-6)
    assert (found.count == n).all()


@pytest.mark.parametrize("draw", ["normal", "exponential", "uniform"])
def test_streams_without_order(draw):
    """In units of the distribution's spread the estimate is within a few times the median's own sampling error."""
    rng = np.random.default_rng(0)
    x = getattr(rng, draw)(size=(400, 200, 3)).astype(np.float32)
    off = over(x).median - np.median(x, 0)
    assert np.sqrt((off**2).mean()) < 1.5 * 1.25 * x.std() / np.sqrt(len(x)) and abs(off.mean()) < 0.02 * x.std()


def test_what_all_frames_agree_on_comes_back_as_it_is():
    assert np.array_equal(over(np.full((60, 4, 3), 0.7, np.float32)).median, np.full((4, 3), 0.7, np.float32))


def test_a_short_highlight_leaves_the_median():
    x = np.random.default_rng(1).normal(1, 0.02, (60, 100, 3)).astype(np.float32)
    x[20:28] *= 30
    assert np.abs(over(x).median - 1).max() < 0.1
