"""Whole accumulation in a box whose light is known."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from addon.core.errors import BadInputError, InterruptedRun
from addon.core.lit_diffuse.accumulate import _choose, accumulate, frame_order
from addon.core.lit_diffuse.medians import Summary
from addon.core.memory import BUDGET
from addon.core.progress import Progress
from addon.core.scene import visibility
from addon.core.scene.element_groups import ElementGroups
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.model import Frame
from addon.core.scene.visibility import CLEAN, EDGE, SATURATED
from tests.core.rooms import all_round, box_sides, look_at, make_room, picture, pixels_of, quad

COLOURS = {i: np.float32([0.1 * (i + 1), 0.5, 2.0 - 0.2 * i]) for i in range(6)}


def frames_of(cameras) -> list[Frame]:
    return [Frame(str(i), Path(str(i)), camera) for i, camera in enumerate(cameras)]


def run(room, cameras, pictures, **options) -> LitDiffuse:
    def read(frame):
        return pictures[int(frame.name)]

    return accumulate(room.mesh, room.atlas, room.scene, frames_of(cameras), read, threads=2, **options)


@pytest.fixture(scope="module")
def box():
    room = make_room(box_sides(), 0.2)
    cameras = [c for eye in ((2, 1.5, 1.2), (1.5, 1.2, 1.4), (2.4, 1.7, 1.1)) for c in all_round(eye, 32)]
    colour = room.by_object(COLOURS)
    return room, cameras, [picture(room, camera, colour) for camera in cameras], colour


@pytest.mark.parametrize("median", ["exact", "p2", "mean"])
def test_walls_of_one_colour_each(box, median):
    room, cameras, pictures, colour = box
    result = run(room, cameras, pictures, median=median)
    assert result.seen.mean() > 0.99
    clean = result.tier == CLEAN
    assert clean.mean() > 0.7
    assert np.allclose(result.radiance[clean], colour[clean], rtol=1e-5)
    assert np.isnan(result.radiance[~result.seen]).all()
    if median != "mean":
        assert np.allclose(result.interquartile_range[clean], 0, atol=1e-5)


def test_the_median_takes_a_moving_highlight_out_and_the_mean_does_not():
    """Seven frames of one wall; in two of them, other ones for each half, it shines."""
    room = make_room([quad((3, 2, -2), (0, -4, 0), (0, 0, 4), 0)], 0.2)
    cameras = [look_at((0, 0.02 * i, 0), (3, 0.02 * i, 0), 40, 40, 75) for i in range(7)]
    pictures = []
    for i in range(7):
        image = np.ones((40, 40, 3))
        image[:, :20] += 20 * (i in (1, 2))
        image[:, 20:] += 20 * (i in (4, 6))
        pictures.append(pixels_of(image))
    exact, mean = run(room, cameras, pictures, median="exact"), run(room, cameras, pictures, median="mean")
    whole = (exact.count == 7) & (np.abs(room.atlas.position[:, 1]) > 0.3)  # in the middle both halves' highlights meet
    assert whole.mean() > 0.5
    assert np.allclose(exact.radiance[whole], 1) and exact.interquartile_range[whole].min() > 0
    assert mean.radiance[whole].min() > 4


def test_the_exact_median_knows_no_order(box):
    room, cameras, pictures, _ = box
    rng = np.random.default_rng(0)
    noisy = [pixels_of(p.radiance * rng.lognormal(0, 0.2, p.radiance.shape)) for p in pictures]
    results = [run(room, cameras, noisy), run(room, cameras, noisy, seed=3), run(room, cameras[::-1], noisy[::-1])]
    for other in results[1:]:
        for name in ("radiance", "interquartile_range", "count", "tier"):
            assert np.array_equal(getattr(results[0], name), getattr(other, name), equal_nan=True), name


def test_frame_order():
    assert sorted(frame_order(50, 0)) == list(range(50))
    assert frame_order(50, 0).tolist() == frame_order(50, 0).tolist() != list(range(50))


def summary(count, value) -> Summary:
    values = np.full((len(count), 3), value, np.float32)
    values[np.array(count) == 0] = np.nan
    return Summary(values, values * 0.5, values * 1.5, np.array(count, np.int32))


def test_the_best_kind_of_observations_is_taken():
    """Elements: enough clean; two clean, more at edges; two clean, one at an edge; edge; saturated; nothing.

    Of what is saturated the upper quartile counts.
    """
    clean, edge = summary([3, 2, 2, 0, 0, 0], 1), summary([9, 4, 1, 1, 0, 0], 2)
    result = _choose(clean, edge, summary([9, 4, 3, 1, 2, 0], 3))
    assert result.tier.tolist() == [CLEAN, EDGE, CLEAN, EDGE, SATURATED, -1]
    assert result.count.tolist() == [3, 4, 2, 1, 2, 0]
    assert np.array_equal(result.radiance[:, 0], [1, 2, 1, 2, 4.5, np.nan], equal_nan=True)
    assert result.interquartile_range[:, 0].tolist() == [1, 2, 1, 2, 3, 0]
    assert result.seen.tolist() == [True] * 5 + [False]


def test_what_most_frames_clip_is_a_lower_bound():
    """Three clean observations, and more that are clipped above them; as many; more, by longer exposures, below."""
    clean, clipped = summary([3, 3, 3], 1), summary([9, 3, 9], 1.2)
    clipped.median[2] = 0.5
    result = _choose(clean, summary([0, 0, 0], 1), clipped)
    assert result.tier.tolist() == [SATURATED, CLEAN, CLEAN]
    assert np.allclose(result.radiance[:, 0], [1.8, 1, 1])
    assert np.allclose(result.clipped, [0.75, 0.5, 0.75])


def test_a_clipped_lamp_is_told_apart(box):
    room, cameras, pictures, _ = box
    clipped = []
    for camera, p in zip(cameras, pictures):
        lamp = np.isclose(p.radiance, COLOURS[1]).all(-1)
        clipped.append(pixels_of(p.radiance, saturated=lamp))
    result = run(room, cameras, clipped)
    ceiling = room.atlas.object_id == 1
    assert (result.tier[ceiling & result.seen] == SATURATED).all() and (result.tier[~ceiling] != SATURATED).all()
    assert np.allclose(result.radiance[ceiling & result.seen], COLOURS[1], rtol=1e-5)


def test_others_may_look_on(box):
    room, cameras, pictures, _ = box
    heard, shares = [], []
    progress = Progress(lambda event: shares.append(event.share))
    run(room, cameras, pictures, also=lambda index, view, pixels, seen: heard.append(
        (index, view.camera is cameras[index], pixels is pictures[index], len(seen.element) > 0)
    ), progress=progress)  # fmt: skip
    assert sorted(heard) == [(i, True, True, True) for i in range(len(cameras))]
    assert len(shares) == len(cameras) and shares == sorted(shares)


def test_a_frame_that_can_not_be_read_stops_the_run(box, tmp_path):
    room, cameras, _, _ = box

    def read(frame):
        raise BadInputError("no")

    with pytest.raises(BadInputError):
        accumulate(room.mesh, room.atlas, room.scene, frames_of(cameras), read, folder=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_wished_stop_is_heard(box, tmp_path):
    room, cameras, pictures, _ = box
    with pytest.raises(InterruptedRun):
        run(room, cameras, pictures, progress=Progress(should_stop=lambda: True), folder=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_second_pass_finds_what_a_first_would():
    """What the cameras were found to see is kept; pixels that are bad in one pass and good in another are seen anew."""
    sheet = quad((2.2, 1.2, 0.2), (0, 0.8, 0), (0, 0, 1.5), 6)
    cameras = [camera for eye in ((1, 1.5, 1.2), (3, 1.4, 1.1)) for camera in all_round(eye, 32)]

    def pictures(bad: int):
        found = [pixels_of(np.random.default_rng(i).random((32, 32, 3))) for i in range(len(cameras))]
        for one in found:
            one.valid[:, bad : bad + 8] = False
        return found

    def parts(room, bad, only=None):
        found = run(room, cameras, pictures(bad), only=only)
        return [getattr(found, name) for name in ("radiance", "interquartile_range", "count", "tier")]

    room = make_room([*box_sides(), sheet], 0.1)
    for bad, only in ((16, None), (0, None), (0, room.atlas.object_id == 6), (8, None)):
        again, fresh = parts(room, bad, only), parts(make_room([*box_sides(), sheet], 0.1), bad, only)
        assert all(np.array_equal(one, other, equal_nan=True) for one, other in zip(again, fresh, strict=True))


def test_a_small_memory_changes_nothing(box, monkeypatch):
    """Frames one by one and in smaller blocks of rows, and what they see found again by each pass."""
    room, cameras, pictures, _ = box
    groups = [ElementGroups(room.atlas) for _ in range(2)]
    first = [run(room, cameras, pictures, groups=groups[0]) for _ in range(2)]
    monkeypatch.setattr(BUDGET, "limit", 1)
    monkeypatch.setattr(visibility, "PIXELS_AT_ONCE", 100)
    again = [run(room, cameras, pictures, groups=groups[1]) for _ in range(2)]
    for a, b in zip(first, again, strict=True):
        for one in fields(a):
            assert np.array_equal(getattr(a, one.name), getattr(b, one.name), equal_nan=True)
