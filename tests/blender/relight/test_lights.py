"""New lights: as strong as they claim, inside the room, aimed at what is looked at."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector  # noqa: E402

from addon.bridge import relight_lights as lights  # noqa: E402
from addon.bridge import relight_state as state  # noqa: E402
from addon.bridge.relight_aim import Placement  # noqa: E402
from addon.bridge.relight_room import bounds, cast, room_light, target_of  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402

DOWN = Vector((0, 0, -1)).to_track_quat("-Z", "Y")


@pytest.mark.parametrize("preset, tall, opening", [
    ("SOFTBOX", 0.4, False), ("SPOT", 0.1, False), ("WINDOW", 1.3, False), ("SUN", 0.8, False), ("SUN", 1.0, True)])
def test_the_irradiance_that_was_asked_for_arrives(scene, shoot, look_down, preset, tall, opening):
    """On a floor of albedo 0.5 straight below: radiance = 0.5 E / pi."""
    sheet(scene, "floor", 6, (0, 0, 0), grey=0.5)
    look_down(0.05, 0.02)  # the camera is below all lights
    place = Placement(Vector((0, 0, 2)), DOWN, tall, tall, opening)
    data = lights._lamp(preset, place, 2.0, 3.0)
    data.color = (1, 1, 1)
    light = bpy.data.objects.new("light", data)
    light.location = place.origin
    scene.collection.objects.link(light)
    seen = shoot(scene, 8, 8, 256).mean()
    assert seen * math.pi / 0.5 == pytest.approx(3.0, rel=0.03)


@pytest.mark.parametrize("preset", lights.PRESETS)
@pytest.mark.parametrize("camera", [0, 3, 7])
def test_it_stands_in_the_room_and_reaches_what_it_is_aimed_at(room, preset, camera):
    cameras = [thing for thing in room.objects if thing.type == "CAMERA"]
    room.camera = cameras[camera]
    target = target_of(room)
    light = lights.add_light(room, preset)
    low, high = bounds(room)
    place = light.matrix_world.translation
    assert all(low[k] <= place[k] <= high[k] for k in range(3))
    way = place - target
    start = target + way.normalized() * 0.03
    hit = cast(room, start, way)
    assert hit is None or hit.distance > way.length - 0.1 or preset == "WINDOW"
    shines = light.matrix_world.to_3x3() @ Vector((0, 0, -1))
    if preset == "WINDOW":
        assert abs(shines.z) < 1e-5 and shines.dot(-way) > 0
    else:
        assert shines.angle(-way) < math.radians(3)
    assert light.data.energy > 0


def test_strength_is_relative_to_the_rooms_own_light(room):
    one, two = (lights.add_light(room, "SOFTBOX", strength) for strength in (1.0, 2.0))
    assert two.data.energy == pytest.approx(2 * one.data.energy, rel=1e-5)
    room["scan_relight_room_light"] = 3 * room_light(room)
    assert lights.add_light(room, "SOFTBOX").data.energy == pytest.approx(3 * one.data.energy, rel=1e-5)


def test_it_aims_at_the_cursor_or_an_object(room):
    room.cursor.location = (2.0, 1.5, 0.6)
    sofa = next(thing for thing in room.objects if thing.name.startswith("sofa "))
    for aim, thing, target in (("CURSOR", None, (2.0, 1.5, 0.6)), ("OBJECT", sofa, sofa.location)):
        light = lights.add_light(room, "SPOT", aim=aim, thing=thing)
        shines = light.matrix_world.to_3x3() @ Vector((0, 0, -1))
        assert shines.angle(Vector(target) - light.matrix_world.translation) < math.radians(1)
    with pytest.raises(BadInputError, match="No object is selected"):
        lights.add_light(room, "SPOT", aim="OBJECT")


def test_without_a_room_it_is_told(scene):
    with pytest.raises(BadInputError, match="no scanned room"):
        lights.add_light(scene, "SPOT")
    assert not lights.added_lights(scene)


def test_the_captured_light_is_exactly_the_captured_one(room, shoot):
    before = shoot(room, 32, 24, 4)
    lamp = state.relight_lamps.find_lamps(room)[0]
    state.relight_lamps.set_factor(lamp, 0.2)
    state.relight_outside.set_on(room.world, False)
    light = lights.add_light(room, "SPOT")
    assert state.is_relit(room)
    changed = shoot(room, 32, 24, 4)
    with pytest.raises(ZeroDivisionError), state.captured_light(room):
        assert np.array_equal(shoot(room, 32, 24, 4), before) and light.hide_render
        1 / 0  # noqa: B018
    assert not light.hide_render and state.relight_lamps.factor(lamp) == pytest.approx(0.2)
    assert np.array_equal(shoot(room, 32, 24, 4), changed) and not np.array_equal(changed, before)
    state.restore_captured(room)
    assert not state.is_relit(room) and not lights.added_lights(room)
    assert np.array_equal(shoot(room, 32, 24, 4), before)
