"""Several exposures of one pose: what they are merged to."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.io.brackets import Exposed, merge
from addon.core.io.layout import Reading
from addon.core.io.pixels import read_pixels
from addon.core.io.png import write_png
from addon.core.io.read import read_capture
from tests.core.io.conftest import HEIGHT, WIDTH

TIMES = (1 / 64, 1 / 8, 1.0, 8.0)
SCENE = np.geomspace(1e-3, 300, HEIGHT * WIDTH).reshape(HEIGHT, WIDTH, 1) * [1, 0.8, 0.6]


def shot(radiance, time, saturation=1.0, noise=None, usable=None) -> Exposed:
    stored = radiance * time if noise is None else noise.poisson(radiance * time * 5000) / 5000
    stored = np.minimum(stored, saturation).astype(np.float32)
    usable = np.ones(stored.shape[:2], bool) if usable is None else usable
    return Exposed(stored, usable, (stored >= saturation).any(-1), time, saturation)


def test_merged_is_the_scene_where_any_exposure_shows_it():
    radiance, valid, saturated = merge(shot(SCENE, time) for time in TIMES)
    shown = SCENE.max(-1) * TIMES[0] < 1
    np.testing.assert_array_equal(saturated, ~shown)
    assert valid.all() and 0 < shown.sum() < shown.size
    np.testing.assert_allclose(radiance[shown], SCENE[shown], rtol=1e-5)
    assert (radiance[~shown] <= SCENE[~shown] * (1 + 1e-6)).all()
    np.testing.assert_allclose(radiance[~shown].max(-1), 1 / TIMES[0])  # the shortest's bound


def test_less_noise_than_any_single_exposure():
    scene = np.full((60, 60, 3), 0.5)
    noise = np.random.default_rng(0)
    shots = [shot(scene, time, noise=noise) for time in (0.25, 0.5, 1.0)]
    merged = merge(shots)[0].std()
    singles = [(one.rgb / one.exposure).std() for one in shots]
    assert merged < 0.85 * min(singles)
    # Photons of all exposures together: the variance is that of the summed times.
    assert merged == pytest.approx(np.sqrt(0.5 / 5000 / 1.75), rel=0.05)


def test_dark_ends_are_left_out():
    black = shot(np.full((1, 1, 3), 0.01), 1 / 64)
    black.rgb[:] = 0  # below the black level
    radiance, _, saturated = merge([black, shot(np.full((1, 1, 3), 0.01), 1.0)])
    np.testing.assert_allclose(radiance, 0.01, rtol=1e-6)
    dark = [shot(np.full((1, 1, 3), 1e-4), time) for time in (0.5, 1.0)]
    dark[0].rgb[:] = 0
    np.testing.assert_allclose(merge(dark)[0], 1e-4, rtol=1e-6)  # black in all: the longest's
    assert not saturated.any()


def test_what_one_exposure_does_not_say_another_does():
    nothing = np.zeros((HEIGHT, WIDTH), bool)
    low = SCENE / 300
    radiance, valid, _ = merge([shot(low, 0.5, usable=nothing), shot(low, 0.9)])
    np.testing.assert_allclose(radiance, low, rtol=1e-5)
    assert valid.all() and not merge([shot(low, 1.0, usable=nothing)])[1].any()


def bracketed(capture, i, times=(0.125, 1.0, 8.0)):
    """Frame `i` as three pictures of 8 bits."""
    scene = np.geomspace(0.01, 4, HEIGHT * WIDTH).reshape(HEIGHT, WIDTH, 1) * [1, 1, 1]
    names = []
    for k, time in enumerate(times):
        codes = np.rint(np.clip(scene * time, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)
        write_png(capture.root / f"images/{i}-{k}.png", codes)
        names.append(f"images/{i}-{k}.png")
    return scene, names


def test_brackets_in_the_poses_file(capture):
    times = (0.125, 1.0, 8.0)
    scene, names = bracketed(capture, 0)
    capture.frame(
        0,
        file_path=names[0],
        exposure=times[0],
        brackets=[{"file_path": name, "exposure": time} for name, time in zip(names[1:], times[1:])],
    )
    for i in range(1, 10):
        capture.frame(i, exposure=1)
    result = read_capture(capture.root, Reading(transfer="2.2"))
    assert len(result.frames) == 10 and len(result.frames[0].brackets) == 2
    pixels = read_pixels(result.frames[0])
    assert pixels.valid.all() and not pixels.saturated.any()
    np.testing.assert_allclose(pixels.radiance, scene, rtol=0.03)


def test_frames_of_one_pose_and_different_exposures_are_brackets(capture):
    scene, names = bracketed(capture, 0)
    first = capture.transforms["frames"][0]
    rest = capture.transforms["frames"][1:]
    capture.transforms["frames"] = [
        dict(first, file_path=name, exposure=time) for name, time in zip(names, (0.125, 1.0, 8.0))
    ] + [dict(one, exposure=1) for one in rest]
    capture.save()
    result = read_capture(capture.root, Reading(transfer="2.2"))
    assert len(result.frames) == 10 and [len(frame.brackets) for frame in result.frames] == [2] + [0] * 9
    assert any("3 frames share 1 poses" in warning for warning in result.warnings)
    np.testing.assert_allclose(read_pixels(result.frames[0]).radiance, scene, rtol=0.03)


def test_frames_of_one_pose_and_exposure_stay_frames(capture):
    for i in range(10):
        capture.frame(i, transform_matrix=capture.pose(0), exposure=2)
    assert len(read_capture(capture.root).frames) == 10


@pytest.mark.parametrize("brackets, words", [
    ("all", "no list"), ([1], "no list"), ([{"file_path": "images/001.exr"}], "without an exposure"),
    ([{"exposure": 1}], "file_path"), ([{"file_path": "images/absent.exr", "exposure": 1}], "does not exist"),
    ([{"file_path": "images/001.exr", "exposure": -1}], "above 0"),
])  # fmt: skip
def test_bad_brackets_cost_their_frame(capture, brackets, words):
    capture.frame(0, brackets=brackets)
    result = read_capture(capture.root)
    assert len(result.frames) == 9 and any(words in warning for warning in result.warnings), result.warnings


def test_brackets_that_lead_out(capture):
    capture.frame(0, brackets=[{"file_path": "../a.exr", "exposure": 1}])
    with pytest.raises(BadInputError, match="leads out"):
        read_capture(capture.root)
