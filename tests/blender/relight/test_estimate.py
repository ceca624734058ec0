"""How bright the light is, without a picture: against Cycles, which traces all of it."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.data.cameras import frame_cameras  # noqa: E402
from addon.bridge.light import lamps as relight_lamps  # noqa: E402
from addon.bridge.light import outside  # noqa: E402
from addon.bridge.light.kelvin import LUMINANCE  # noqa: E402
from addon.bridge.relight import estimate, lights  # noqa: E402
from addon.bridge.relight import exposure as relight_exposure  # noqa: E402
from addon.bridge.relight import setup as state  # noqa: E402


def rooms_lights(scene):
    """Changes of the light with their names, each from the captured one."""
    lamps = relight_lamps.find_lamps(scene)

    def dark():
        outside.set_on(scene.world, False)
        for lamp in lamps:
            relight_lamps.set_on(lamp, False)

    yield "a quarter", lambda: [relight_lamps.set_factor(lamp, 0.25) for lamp in lamps]
    yield "one lamp off", lambda: relight_lamps.set_on(lamps[0], False)
    for preset in (lights.WINDOW, lights.SOFTBOX, lights.SPOT):
        yield f"only {preset}", lambda preset=preset: (dark(), lights.add_light(scene, preset))
        yield f"{preset} too", lambda preset=preset: lights.add_light(scene, preset, 8.0)


@pytest.mark.slow
@pytest.mark.parametrize("camera", [0, *(pytest.param(k, marks=pytest.mark.once) for k in (4, 7))])
def test_it_is_about_a_stop_from_cycles(room, shoot, camera):
    room.camera = frame_cameras(room)[camera]
    assert estimate.stops(room) is None and not relight_exposure.darkness(room), "it was not looked for yet"
    captured = np.median(shoot(room, 48, 36, 64) @ LUMINANCE)
    assert estimate.estimate(room) == pytest.approx(0.0, abs=1e-6)
    for name, change in rooms_lights(room):
        change()
        traced = math.log2(np.median(shoot(room, 48, 36, 64) @ LUMINANCE) / captured)
        # A new light alone leaves the median to what bounces off what it lights, which is not followed.
        near = 2.0 if name.startswith("only") else 1.0
        assert estimate.estimate(room) == pytest.approx(traced, abs=near), name
        state.restore_captured(room)


def test_what_the_panel_says(room):
    estimate.estimate(room)
    assert relight_exposure.darkness(room) == ""
    lamps = relight_lamps.find_lamps(room)
    outside.set_factor(room.world, 0.125)
    for lamp in lamps:
        relight_lamps.set_factor(lamp, 0.125)
    said = relight_exposure.darkness(room)
    assert said == "The light is about 3.0 stops darker than captured; exposure is as captured."
    captured = room.view_settings.exposure
    relight_exposure.follow(room)
    assert room.view_settings.exposure == pytest.approx(captured + 3) and relight_exposure.darkness(room) == ""
    state.restore_captured(room)
    assert "about as captured; exposure is 3.0 stops up" in relight_exposure.darkness(room)
    relight_exposure.restore(room)
    assert room.view_settings.exposure == pytest.approx(captured)
    for lamp in lamps:
        relight_lamps.set_on(lamp, False)
    outside.set_on(room.world, False)
    assert "No light is on" in relight_exposure.darkness(room)


def test_following_renders_nothing(package, room):
    studio = bpy.context.scene.scan_relight_studio
    exposure = bpy.context.scene.view_settings.exposure
    studio.follow = True
    assert bpy.context.scene.view_settings.exposure == pytest.approx(exposure)
    for lamp in relight_lamps.find_lamps(room):
        lamp.scan_relight_lamp.factor = 4.0
    if outside.has_outside(room):
        room.world.scan_relight_outside.factor = 4.0
    assert bpy.context.scene.view_settings.exposure == pytest.approx(exposure - 2, abs=0.01)
    assert not [one for one in bpy.data.images if one.type == "RENDER_RESULT"]
