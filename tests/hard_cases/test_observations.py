"""Hard cases of what the frames give: few and many observations, sorted and tied ones, overflow, grazing views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.io.exr import write_exr
from addon.core.io.pixels import read_pixels
from addon.core.lit_diffuse.accumulate import accumulate
from addon.core.lit_diffuse.medians import make_estimator
from addon.core.scene.model import Frame
from tests.core.rooms import all_round, look_at, picture, pixels_of
from tests.hard_cases.rooms import CLOSE, GREY, NOISY, PAPERS, QUICK, cameras, closed_room, lamp_light, lamp_room

MANY = 5000


def gains(count: int, order: str) -> np.ndarray:
    """`count` factors of median 1, a fifth of them highlights, in an order that is hard on a running estimate."""
    rng = np.random.default_rng(1)
    values = np.exp(rng.normal(0, 0.03, count))
    values[: count // 5] *= 8
    values /= np.median(values)
    if order == "ascending":
        return np.sort(values)
    if order == "descending":
        return np.sort(values)[::-1]
    if order == "tied":  # three in four are one and the same value
        return np.where(np.arange(count) % 4 == 0, rng.permutation(values), 1.0)
    return rng.permutation(values)


def estimate(name: str, factors: np.ndarray, level: float) -> np.ndarray:
    """Median of three elements that each see all factors: (3, 3)."""
    estimator = make_estimator(name, 3)
    element = np.arange(3, dtype=np.int32)
    for factor in factors:
        estimator.add(element, np.full((3, 3), level * factor, np.float32))
    summary = estimator.result()
    estimator.close()
    assert (summary.count == len(factors)).all()
    assert (summary.lower <= summary.median).all() and (summary.median <= summary.upper).all()
    return summary.median


@pytest.mark.parametrize("order", ["shuffled", "ascending", "descending", "tied"])
@pytest.mark.parametrize("name", ["exact", "p2"])
def test_median_of_5000_observations(expect, name, order):
    """Near a half float's end, where a sum in 16 bits would overflow.

    As in a run 'p2' gets the frames as filmed, whose trend biases it.
    """
    factors = gains(MANY, order)
    found = estimate(name, factors, 6e4)
    p_square = {"shuffled": 0.01, "descending": 0.1, "ascending": 0.3, "tied": 1e-6}
    within = {"exact": 1e-6, "p2": p_square[order]}[name]
    expect("the median, 60,000", float(np.abs(found / 6e4 - 1).max()), within)


@pytest.mark.parametrize("name", ["exact", "p2"])
@pytest.mark.parametrize("count", [1, 3, 4, 6])
def test_median_of_few_observations(expect, name, count):
    values = np.float32([5, 1, 4, 2, 3, 6])[:count]
    within = 1e-6 if name != "p2" or count < 6 else 0.15
    off = np.abs(estimate(name, values, 1e-6) / (1e-6 * np.median(values)) - 1).max()
    expect("the median of 1 to 6 values", float(off), within)


def test_5000_frames_of_one_room(expect):
    """The accumulation itself over 5,000 frames, a fifth of them eight times too bright."""
    room = closed_room(0.2)
    light = np.repeat(np.linspace(0.1, 1, len(room.atlas), dtype=np.float32)[:, None], 3, 1)
    camera = look_at((1, 1, 1.6), (1, 1, 0), 10, 10, 70)
    plain = picture(room, camera, light).radiance
    factors = gains(MANY, "shuffled").astype(np.float32)
    frames = [Frame(str(i), None, camera) for i in range(MANY)]
    lit = accumulate(
        room.mesh, room.atlas, room.scene, frames, lambda frame: pixels_of(plain * factors[int(frame.name)]), threads=2
    )
    once = accumulate(room.mesh, room.atlas, room.scene, frames[:1], lambda frame: pixels_of(plain))
    seen = once.seen & (lit.tier == once.tier)
    assert lit.count[seen].max() == MANY and seen.sum() > 50
    off = np.abs(lit.radiance[seen] / once.radiance[seen] - 1).max()
    expect("the picture without its highlights", float(off), 2e-3)


@pytest.mark.parametrize("settings", [QUICK, PAPERS], ids=["default", "paper"])
def test_three_observations_a_texel(capture, expect, settings):
    """Three places to look from; a third of the pictures hold a large highlight of five times the radiance."""
    room = lamp_room()
    eyes = (0.9, 0.9, 1.0), (1.1, 1.0, 0.9), (1.0, 1.1, 1.1)
    views = [camera for eye in eyes for camera in all_round(eye, 28, 90)]

    def spoil(image, i):
        image = image.copy()
        if i in (0, 1, 2, 3, 5):  # walls and floor; 4 looks up at the lamp
            image[6:22, 6:22] *= 5
        return image

    run = capture(room, lamp_light(room), views=views, edit=spoil).recover(settings)
    assert np.percentile(run.lit.count[run.lit.seen], 90) == 3
    expect("the walls, of which one view in three is wrong in its middle", run.worst(GREY), NOISY)


def test_grazing_views_count_for_nothing(capture, expect):
    """What is seen at less than 12 degrees off the surface is left out: here such pixels are ten times too bright."""
    room = lamp_room()
    views = cameras()

    def spoil(image, i):
        camera = views[i]
        directions = camera.directions(camera.pixel_centres())
        hits = room.scene.intersect(np.broadcast_to(camera.centre.astype(np.float32), directions.shape), directions)
        cosine = -np.einsum("ij,ij->i", directions, room.normals[hits.triangle])
        return image * np.where(cosine < 0.19, 10, 1).reshape(*image.shape[:2], 1)

    light = lamp_light(room)
    with_them = capture(room, light, views=views, edit=spoil).recover()
    expect("the walls", with_them.worst(GREY), CLOSE)


def test_floor_seen_at_grazing_angles_only(capture, expect):
    """Cameras skim a floor: its albedo can't be had, counts as filled in, and the report names it."""
    room = lamp_room()
    eyes = (0.1, 0.5, 0.02), (0.1, 1.0, 0.02), (0.1, 1.5, 0.02)
    views = [look_at(eye, np.add(eye, way), 28, 28, 60) for eye in eyes for way in ((1, 0, 0.6), (1, 0.5, 0.55))]
    views += [look_at((1, 1, 1), target, 28, 28, 60) for target in ((2, 1, 1.3), (1, 2, 1.3), (1, 0, 1.3), (0, 1, 1.3))]
    views += [look_at((1, 1, 0.6), (1.0, 1.1, 2), 28, 28, 100)]
    run = capture(room, lamp_light(room), views=views).recover()
    # 2 cm above the floor, what lies over 10 cm away is seen at less than 12 degrees.
    skimmed = run.measured(0) & (run.atlas.position[:, 0] > 0.3)
    expect("elements of the skimmed floor that count as measured", int(skimmed.sum()), 0)
    assert "No frame sees thing 0" in run.text or run.measured(0).any()
    assert run.figures["unseen_share"] > 0.1


@pytest.mark.parametrize("value", [np.inf, 65504.0], ids=["inf", "65504"])
def test_half_float_overflow_in_one_view_of_many(capture, expect, value):
    """A highlight beyond 65,504 is no value: the views without it decide."""
    room = lamp_room()

    def spoil(image, i):
        image = image.copy()
        if i < 6:
            image[8:20, 8:20] = value
        return image

    run = capture(room, lamp_light(room), edit=spoil, half=True).recover()
    expect("the walls", run.worst(GREY), CLOSE)


def test_what_a_picture_says_of_overflow(tmp_path, expect):
    """inf and 65,504 are both the end of a half float: clipped, a lower bound. NaN and -inf are nothing at all."""
    values = np.float32([1, 65504, np.inf, np.nan, -np.inf, 65472])
    path = tmp_path / "a.exr"
    write_exr(path, np.repeat(values[None, :, None], 3, 2), half=True)
    found = read_pixels(Frame("a", path, replace(look_at((0, 0, 0), (1, 0, 0)), width=6, height=1)))
    assert found.saturated[0].tolist() == [False, True, True, False, False, False]
    assert np.isfinite(found.radiance).all() and found.radiance[0, 1, 0] == 65504
    assert found.valid[0].tolist()[3:] == [False, False, True]
    expect("a value just below", abs(float(found.radiance[0, 5, 0]) - 65472), 0)
