"""Detail put back onto L_d: a wall with thin lines, as frames with coarse pixels show it."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.errors import InterruptedRun
from addon.core.passes.sharpening.sharpen import sharpened
from addon.core.progress import Progress
from tests.core.lit_diffuse.test_accumulate import frames_of, run
from tests.core.rooms import look_at, make_room, pixels_of, quad

WALL = quad((3, 2, -2), (0, -4, 0), (0, 0, 4), 0)
TEXEL, LINE, EVERY = 0.05, 0.1, 0.4
DARK, FINE = 0.3, 8


def lines(y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """1, and DARK in lines across and along."""
    return np.where((y % EVERY < LINE) | (z % EVERY < LINE), DARK, 1.0)


def photo(camera, shown=lines):
    """Each pixel the mean over its square of what lies there on the wall."""
    n = camera.width
    at = (np.stack(np.meshgrid(*[np.arange(n * FINE)] * 2), -1).reshape(-1, 2) + 0.5) / FINE
    way = camera.directions(at).astype(float)
    place = camera.centre + way * ((3 - camera.centre[0]) / way[:, :1])
    value = shown(place[:, 1], place[:, 2]).reshape(n, FINE, n, FINE).mean((1, 3))
    return np.repeat(value[..., None], 3, 2)


def views(count: int = 8):
    """Pixels of about 6 cm on the wall, no two frames alike."""
    rng = np.random.default_rng(0)
    ends = rng.uniform(-0.3, 0.3, (count, 2, 2))
    return [look_at((0.5, *eye), (3, *to), 60, 60, 75) for eye, to in ends]


@pytest.fixture(scope="module")
def wall():
    return make_room([WALL], TEXEL)


def both(wall, cameras, images, **options):
    pictures = [pixels_of(image) for image in images]
    lit = run(wall, cameras, pictures)
    after = sharpened(lit, wall, frames_of(cameras), lambda frame: pictures[int(frame.name)], threads=2, **options)
    return lit, after


def inner(wall, lit):
    at = np.abs(wall.atlas.position[:, 1:]).max(1) < 1.2
    return np.flatnonzero(at & (lit.count >= 5))


@pytest.mark.parametrize("median", ["exact", "p2"])
def test_lines_get_their_darkness_back(wall, median):
    cameras = views()
    lit, after = both(wall, cameras, [photo(camera) for camera in cameras], median=median)
    own = inner(wall, lit)
    spread = (np.arange(FINE) + 0.5) / FINE * TEXEL - TEXEL / 2
    y, z = (wall.atlas.position[own, k, None] + grid.ravel() for k, grid in zip((1, 2), np.meshgrid(spread, spread)))
    truth = lines(y, z).mean(1)
    error = [np.sqrt(np.mean((one.radiance[own, 0] - truth) ** 2)) for one in (lit, after)]
    assert error[1] < 0.75 * error[0]
    dark = truth < DARK + 0.01
    paler = [one.radiance[own[dark], 0].mean() - DARK for one in (lit, after)]
    assert paler[1] < 0.6 * paler[0]
    assert np.array_equal(after.count, lit.count) and np.array_equal(after.seen, lit.seen)


def test_an_even_wall_stays_as_it_is(wall):
    """With a slow change of light over it."""
    cameras = views()
    lit, after = both(wall, cameras, [photo(camera, lambda y, z: 1 + 0.05 * y) for camera in cameras])
    own = inner(wall, lit)
    assert np.array_equal(after.radiance[own], lit.radiance[own])


def test_a_highlight_in_two_of_eight_frames_stays_out(wall):
    cameras = views()
    images = [photo(camera) for camera in cameras]
    for image in images[:2]:
        image[20:40, 20:40] += 10
    plain = both(wall, cameras, [photo(camera) for camera in cameras])[1]
    lit, after = both(wall, cameras, images)
    own = inner(wall, lit)
    assert np.quantile(np.abs(after.radiance[own] - plain.radiance[own]), 0.99) < 0.1
    assert after.radiance[own].max() < 1.3


def test_what_few_frames_saw_is_left_alone(wall):
    cameras = views(2)
    lit, after = both(wall, cameras, [photo(camera) for camera in cameras])
    assert lit.seen.any() and np.array_equal(after.radiance, lit.radiance, equal_nan=True)


def test_it_can_be_stopped(wall):
    cameras = views(3)
    images = [photo(camera) for camera in cameras]
    with pytest.raises(InterruptedRun):
        both(wall, cameras, images, progress=Progress(should_stop=lambda: True))
