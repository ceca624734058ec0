"""New lights: as strong as they claim, inside the room, aimed at what is looked at."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector  # noqa: E402

from addon.bridge.light.kelvin import LUMINANCE  # noqa: E402
from addon.bridge.light.room import bounds, cast, room_light  # noqa: E402
from addon.bridge.relight import lights as lights  # noqa: E402
from addon.bridge.relight import setup as state  # noqa: E402
from addon.bridge.relight.aim import Placement  # noqa: E402
from addon.bridge.relight.subject import side_of, subject_of  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402

DOWN = Vector((0, 0, -1)).to_track_quat("-Z", "Y")


@pytest.mark.parametrize(
    "preset, tall, opening",
    [("SOFTBOX", 0.4, False), ("SPOT", 0.1, False), ("WINDOW", 1.3, False), ("SUN", 0.8, False), ("SUN", 1.0, True)],
)
def test_the_irradiance_that_was_asked_for_arrives(scene, shoot, look_down, preset, tall, opening):
    """On a floor of albedo 0.5 straight below: radiance = 0.5 E / pi."""
    sheet(scene, "floor", 6, (0, 0, 0), grey=0.5)
    look_down(0.05, 0.02)  # the camera is below all lights
    place = Placement(Vector((0, 0, 2)), DOWN, tall, tall, opening)
    data = lights._lamp(preset, place, 2.0, 3.0)
    light = bpy.data.objects.new("light", data)
    light.location = place.origin
    scene.collection.objects.link(light)
    seen = (shoot(scene, 8, 8, 256) @ LUMINANCE).mean()
    assert seen * math.pi / 0.5 == pytest.approx(3.0, rel=0.03)


@pytest.mark.parametrize("preset", lights.PRESETS)
@pytest.mark.parametrize("camera", [0, 3, 7])
def test_it_stands_free_in_the_room_and_faces_what_it_is_for(room, preset, camera):
    cameras = [thing for thing in room.objects if thing.type == "CAMERA"]
    room.camera = cameras[camera]
    light = lights.add_light(room, preset)
    pose, data = light.matrix_world, light.data
    shines = pose.to_3x3() @ Vector((0, 0, -1))
    assert data.energy > 0 and light.name.split(".")[0].startswith(lights.NAMES[preset])
    target = subject_of(room, "VIEW").target
    assert shines.dot((target - pose.translation).normalized()) > 0.3 or data.type == "SUN"
    if data.type == "SUN":
        return
    low, high = bounds(room)
    assert all(low[k] <= pose.translation[k] <= high[k] for k in range(3))
    reach = (data.size / 2, data.size_y / 2) if data.type == "AREA" else (data.shadow_soft_size,) * 2
    for across, up in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        way = pose.to_3x3() @ Vector((across * reach[0], up * reach[1], 0))
        hit = cast(room, pose.translation, way)
        assert hit is None or hit.distance > way.length - 1e-3, "it sticks in something"


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["WINDOW", "SOFTBOX", "SPOT"])
@pytest.mark.parametrize("camera", [1, *(pytest.param(k, marks=pytest.mark.once) for k in (4, 8))])
def test_what_the_camera_looks_at_is_lit(room, shoot, preset, camera):
    """With nothing else on, most of the picture is within three stops of the captured one; of a spot's, a tenth."""
    room.camera = [thing for thing in room.objects if thing.type == "CAMERA"][camera]
    before = shoot(room, 48, 36, 32) @ LUMINANCE
    for lamp in state.relight_lamps.find_lamps(room):
        state.relight_lamps.set_on(lamp, False)
    state.relight_outside.set_on(room.world, False)
    lights.add_light(room, preset)
    after = shoot(room, 48, 36, 32) @ LUMINANCE
    assert np.quantile(after / np.maximum(before, 1e-6), 0.9 if preset == "SPOT" else 0.5) > 1 / 8
    assert np.quantile(after, 0.99) < 40 * np.quantile(before, 0.9)


@pytest.mark.slow
@pytest.mark.parametrize("preset, steepest", [("SOFTBOX", 0.25), ("SPOT", 0.3)])
def test_no_edge_is_burnt_into_the_ceiling(scene, shoot, preset, steepest):
    """In a room of 5 x 4 x 2.7 m, seen across; the ceiling from below, 5 cm a pixel."""
    walls = (
        ((0, 0, 0), (0, 0, 0)),
        ((0, 0, 2.7), (math.pi, 0, 0)),
        ((2.5, 0, 0), (0, -math.pi / 2, 0)),
        ((-2.5, 0, 0), (0, math.pi / 2, 0)),
        ((0, 2, 0), (math.pi / 2, 0, 0)),
        ((0, -2, 0), (-math.pi / 2, 0, 0)),
    )
    for number, (place, turn) in enumerate(walls):
        sheet(scene, f"wall {number}", 6, place, turn, number)
    scene["scan_relight_room_light"] = 1.0
    eye = camera(scene, (-2.0, 0, 1.5), Vector((1, 0, -0.05)))
    scene.camera = eye
    lights.add_light(scene, preset)
    up = camera(scene, (0, 0, 2.69), Vector((0, 0, 1)))
    up.data.type, up.data.ortho_scale = "ORTHO", 4.8
    scene.camera = up
    seen = shoot(scene, 96, 76, 256) @ LUMINANCE
    assert seen.max() < 6 * np.median(seen)
    smooth = (seen[:-1:2, ::2] + seen[1::2, ::2] + seen[:-1:2, 1::2] + seen[1::2, 1::2]) / 4
    steps = [np.abs(np.diff(smooth, axis=axis)).max() / seen.max() for axis in (0, 1)]
    assert max(steps) < steepest, steps


def camera(scene, place, looks):
    data = bpy.data.cameras.new("camera")
    data.clip_start = 1e-3
    thing = bpy.data.objects.new("camera", data)
    thing.location, thing.rotation_euler = place, looks.to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    return thing


def test_its_name_says_what_it_does(scene):
    """A ball on a floor before the camera, a wall behind it, and nothing else."""
    sheet(scene, "floor", 8, (0, 0, 0))
    sheet(scene, "wall", 8, (0, 3, 0), (math.pi / 2, 0, 0), 1)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(0, 1, 0.5))
    ball = bpy.context.object
    ball.name, ball["object_id"] = "ball 2", 2
    scene.camera = camera(scene, (0, -2, 0.8), Vector((0, 1, -0.1)))
    scene["scan_relight_room_light"] = 1.0
    spot = lights.add_light(scene, "SPOT")
    assert spot.name == "Spot on ball 2"
    box = lights.add_light(scene, "SOFTBOX")
    assert box.name.startswith("Softbox from ")
    assert side_of(scene, Vector((0, 1, 0.5)), Vector((1.5, -0.5, 1.0))) == "the right"
    assert side_of(scene, Vector((0, 1, 0.5)), Vector((-1.5, -0.5, 1.0))) == "the left"
    assert side_of(scene, Vector((0, 1, 0.5)), Vector((0.1, -1.5, 1.0))) == "the camera's side"
    assert side_of(scene, Vector((0, 1, 0.5)), Vector((0.1, 0.9, 2.5))) == "above"


def test_a_panel_on_the_wall_is_no_subject(scene):
    """A panel fills the picture's middle, and of a stool only a little is seen: the light is for the stool."""
    sheet(scene, "floor", 4, (0, 0, 0))
    for number, (place, turn) in enumerate(
        (
            ((0, 2, 1), (math.pi / 2, 0, 0)),
            ((2, 0, 1), (0, -math.pi / 2, 0)),
            ((-2, 0, 1), (0, math.pi / 2, 0)),
            ((0, -2, 1), (-math.pi / 2, 0, 0)),
        ),
        1,
    ):
        sheet(scene, f"wall {number}", 4, place, turn, number)
    sheet(scene, "panel 5", 2.5, (0, 1.9, 1.3), (math.pi / 2, 0, 0), 5)
    bpy.ops.mesh.primitive_cube_add(size=0.7, location=(0.5, 0.6, 0.35))
    stool = bpy.context.object
    stool.name, stool["object_id"] = "stool 6", 6
    scene.camera = camera(scene, (0, -1.8, 1.2), Vector((0, 1, -0.1)))
    bpy.context.view_layer.update()
    assert subject_of(scene, "VIEW").name == "stool 6"
    stool.hide_set(True)
    bpy.context.view_layer.update()
    assert subject_of(scene, "VIEW").name == ""


def test_strength_is_relative_to_the_rooms_own_light(room):
    one, two = (lights.add_light(room, "SOFTBOX", strength) for strength in (1.0, 2.0))
    assert two.data.energy == pytest.approx(2 * one.data.energy, rel=1e-5)
    room["scan_relight_room_light"] = 3 * room_light(room)
    assert lights.add_light(room, "SOFTBOX").data.energy == pytest.approx(3 * one.data.energy, rel=1e-5)


def test_it_aims_at_the_cursor_or_an_object(room):
    room.cursor.location = (2.0, 1.5, 0.6)
    sofa = next(thing for thing in room.objects if thing.name.startswith("sofa "))
    for aim, thing, target in (("CURSOR", None, (2.0, 1.5, 0.6)), ("OBJECT", sofa, sofa.location)):
        light = lights.add_light(room, "SPOT", aim=aim, obj=thing)
        shines = light.matrix_world.to_3x3() @ Vector((0, 0, -1))
        assert shines.angle(Vector(target) - light.matrix_world.translation) < math.radians(1)
    with pytest.raises(BadInputError, match="No object is selected"):
        lights.add_light(room, "SPOT", aim="OBJECT")


def test_without_a_room_it_is_told(scene):
    with pytest.raises(BadInputError, match="no scanned room"):
        lights.add_light(scene, "SPOT")
    assert not lights.added_lights(scene)


@pytest.mark.slow
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
