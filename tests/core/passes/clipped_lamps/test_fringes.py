"""The colour of a clipped lamp, from the pixels that it covers in part."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from addon.core.luminance import LUMINANCE
from addon.core.passes.clipped_lamps.fringes import FringeCollector
from addon.core.scene.model import Pixels

LAMP, WALL = 7, 2
RADIANCE, BEHIND = np.array([28.0, 26.0, 17.0]), np.array([0.3, 0.2, 0.1])


def picture(limit=4.0, shift=0.0, noise=0.0, radiance=RADIANCE, seed=0):
    """A tilted square lamp before a wall, its edges covered in part; ids are off by `shift` pixels."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:48, :64] + rng.random(2)[:, None, None]

    def inside(x, y):
        u, v = (x - 32) * 0.94 + (y - 24) * 0.34, (y - 24) * 0.94 - (x - 32) * 0.34
        return (np.abs(u) < 9) & (np.abs(v) < 7)

    fine = (np.arange(8) + 0.5) / 8 - 0.5
    share = np.mean([inside(x + a, y + b) for a in fine for b in fine], 0)[..., None]
    shown = (share * radiance + (1 - share) * BEHIND) * (1 + noise * rng.normal(size=(48, 64, 3)))
    saturated = (shown >= limit).any(-1)
    ids = np.where(inside(x + shift, y), LAMP, WALL)
    pixels = Pixels(np.minimum(shown, limit).astype(np.float32), np.ones(saturated.shape, bool), saturated)
    return SimpleNamespace(object_id=ids), pixels


def collected(frames):
    collector = FringeCollector()
    for view, pixels in frames:
        collector.add(view, pixels)
    return collector.result().colours()


@pytest.mark.parametrize("shift", [0.0, 2.0])
def test_colour_from_the_edges(shift):
    """Noise of 2 % and ids off by two pixels change nothing."""
    found = collected(picture(shift=shift, noise=0.02, seed=k) for k in range(5))
    assert list(found) == [LAMP]
    np.testing.assert_allclose(found[LAMP], RADIANCE / (RADIANCE @ LUMINANCE), rtol=0.03)


def test_the_clipped_values_themselves_would_be_grey():
    view, pixels = picture()
    inner = pixels.radiance[pixels.saturated & (view.object_id == LAMP)]
    assert np.ptp(np.median(inner, 0)) < 1e-3


def test_too_few_pixels_are_no_colour():
    view, pixels = picture()
    pixels.valid[:, :36] = False  # all but a strip of the lamp lies under a mask
    pixels.valid[24:] = False
    assert not collected([(view, pixels)])


def test_a_spot_of_many_objects_is_nobodys():
    view, pixels = picture()
    view.object_id[:] = np.arange(48)[:, None] % 5
    assert not collected([(view, pixels)] * 5)


def test_invalid_neighbours_say_nothing():
    view, pixels = picture(noise=0.02)
    masked = Pixels(pixels.radiance, pixels.saturated, pixels.saturated)  # all that is not clipped is masked
    assert not collected([(view, masked)] * 5)
