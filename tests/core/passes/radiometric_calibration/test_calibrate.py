"""Exposure, white balance, response and vignetting of frames of codes, from what they show together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.core.passes.radiometric_calibration.calibrate import Calibration, calibrate, solve
from addon.core.passes.radiometric_calibration.observations import CodeObservations
from addon.core.passes.radiometric_calibration.params import CALIBRATION
from addon.core.scene.model import AUTO, Frame, Pixels
from tests.core.rooms import all_round, lit_box, make_room, picture, radiosity

FRAMES = 24
FALLOFF = np.array([-0.5, 0.1])


def camera_response(linear, gamma=(2.05, 2.1, 2.15)):
    """Codes of linear light: a gamma, and a shoulder above .7."""
    bent = np.where(linear < 0.7, linear, 0.7 + 0.3 * np.tanh((linear - 0.7) / 0.3))
    return bent ** (1 / np.array(gamma))


def gains(rng, frames, stops=0.8):
    """Exposures and white balance: a slow drift, and steps."""
    exposure = 2 ** (stops * np.sin(np.linspace(0, 7, frames)) + 0.2 * rng.normal(size=frames))
    balance = 1 + 0.1 * np.sin(np.linspace(0, 4, frames)[:, None] + np.arange(3))
    return 0.3 * exposure[:, None] * balance


def seen_by(rng, gain, places=3000, views=8, outliers=0.1):
    """Observations of random places, each by `views` frames; a share of them shows a highlight."""
    radiance = np.exp(rng.normal(0, 0.6, (places, 3)))
    point = np.repeat(np.arange(places), views)
    frame = np.concatenate([rng.choice(len(gain), views, replace=False) for _ in range(places)])
    r2 = rng.uniform(0, 1, len(point))
    light = radiance[point] * gain[frame] * np.exp(FALLOFF[0] * r2 + FALLOFF[1] * r2**2)[:, None]
    light *= 1 + (rng.random(len(point)) < outliers)[:, None] * rng.exponential(1.0, (len(point), 1))
    code = camera_response(light) + rng.normal(0, 2 / 255, light.shape)
    usable = (code > CALIBRATION.darkest).all(1) & (code < 253.5 / 255).all(1)
    histogram = np.zeros((len(gain), 3, 256))
    return CodeObservations(point[usable], frame[usable], r2[usable], code[usable], histogram)


def off(found, true):
    """Errors of log gains, after one constant for each channel."""
    error = np.log(found / true)
    return error - np.median(error, 0)


@pytest.mark.parametrize("seed", [0, 1])
def test_gains_response_and_vignetting_are_found_among_highlights(seed):
    rng = np.random.default_rng(seed)
    gain = gains(rng, FRAMES)
    response, found, falloff, _ = solve(seen_by(rng, gain), FRAMES, np.zeros(FRAMES))
    error = off(found, gain)
    assert np.abs(error.mean(1)).max() < 0.1 * np.log(2)  # stops
    assert np.abs(error - error.mean(1, keepdims=True)).max() < 0.03
    r2 = np.linspace(0, 1, 20)
    np.testing.assert_allclose(falloff[0] * r2 + falloff[1] * r2**2, FALLOFF[0] * r2 + FALLOFF[1] * r2**2, atol=0.06)
    light = np.linspace(0.1, 1, 50)  # where codes occur
    codes = camera_response(np.tile(light[:, None], 3))
    for c in range(3):
        told = np.interp(codes[:, c], np.linspace(0, 1, 256), response[c])
        scale = (told * light).sum() / (told**2).sum()
        back = np.interp(light, told * scale, codes[:, c])
        assert np.abs(back - codes[:, c]).max() < 0.04


def test_stated_exposures_tell_the_contrast_that_pictures_cannot():
    """A curve of gamma 3 looks like sRGB's with smaller steps; the steps' true size decides."""
    rng = np.random.default_rng(2)
    gain = np.repeat(gains(rng, FRAMES).mean(1, keepdims=True), 3, 1)
    seen = seen_by(rng, gain, outliers=0.0)
    flatter = replace(seen, code=np.clip(seen.code, 0, 1) ** (2 / 3))
    unstated = solve(flatter, FRAMES, np.zeros(FRAMES))[1]
    stated = solve(flatter, FRAMES, np.log(gain[:, 0]))[1]
    steps = np.log(gain[:, 0]).std()
    assert np.log(stated).mean(1).std() == pytest.approx(steps, rel=0.03)
    assert np.log(unstated).mean(1).std() < 0.85 * steps


def test_a_room_is_seen_alike_by_calibrated_frames():
    """Frames of one room with exposures of their own; afterwards they agree on its radiance."""
    room = make_room(lit_box(lamps=(((0.4, 0.6), (0.4, 0.6)),)), 0.1)
    light = radiosity(room, {i: 0.3 + 0.08 * i for i in range(6)}, {6: (5, 5, 5)})
    eyes = [(1.2 + 0.3 * i, 1.4, 1.2) for i in range(3)]
    cameras = [camera for eye in eyes for camera in all_round(eye, 64)]
    rng = np.random.default_rng(0)
    gain = gains(rng, len(cameras))
    pictures = [picture(room, camera, light) for camera in cameras]
    frames = [Frame(f"{i}", Path(f"{i}.png"), camera, transfer=AUTO) for i, camera in enumerate(cameras)]
    level = 0.4 / np.median(light)

    def read(frame):
        i = int(frame.name)
        codes = np.round(255 * camera_response(level * pictures[i].radiance * gain[i])) / 255
        return Pixels(np.float32(np.minimum(codes, 1)), pictures[i].valid, (codes >= 253.5 / 255).any(-1))

    found = calibrate(room.mesh, room.scene, frames, read)
    assert found.calibrated.all() and np.isfinite(found.spread)
    error = off(found.gain, gain)
    assert np.abs(error.mean(1)).max() < 0.1 * np.log(2)
    assert np.abs(error - error.mean(1, keepdims=True)).max() < 0.05
    assert all(frame.radiometry is not None and not frame.uncalibrated for frame in found.of(frames))


def test_frames_of_floats_and_too_few_codes_are_left_alone():
    room = make_room(lit_box(lamps=(((0.4, 0.6), (0.4, 0.6)),)), 0.2)
    frames = [Frame(f"{i}", Path(f"{i}.png"), camera) for i, camera in enumerate(all_round((2, 1.5, 1.2), 16))]
    unread = Calibration.none(len(frames))
    found = calibrate(room.mesh, room.scene, frames, lambda frame: pytest.fail("was read"))
    np.testing.assert_array_equal(found.calibrated, unread.calibrated)
    assert found.of(frames) == tuple(frames)
    few = [replace(frame, transfer=AUTO) for frame in frames[:2]]
    assert not calibrate(room.mesh, room.scene, few, lambda frame: pytest.fail("was read")).calibrated.any()


def test_frames_clip_at_the_colour_that_their_gains_make_white():
    calibration = replace(Calibration.none(3), gain=np.array([[1.0, 2, 3], [2, 4, 8], [1, 2, 4]]))
    assert calibration.clip_colour.tolist() == [0.25, 0.5, 1]
    assert Calibration.none(0).clip_colour.tolist() == [1, 1, 1]
