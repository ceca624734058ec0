"""Set-ups that are kept and used elsewhere, the exposure that a light asks for, light probes."""

import json
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix, Vector  # noqa: E402

from addon.bridge.light import lamps, outside  # noqa: E402
from addon.bridge.light import room as relight_room  # noqa: E402
from addon.bridge.relight import exposure, lights, probe, setup  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402


def build(scene, size):
    """A box room `size` times 4 x 3 x 2.5 m with a lamp under its ceiling; a camera that looks along +X."""
    for number, (place, turn) in enumerate(
        (
            ((0, 0, 0), (0, 0, 0)),
            ((0, 0, 2.5), (math.pi, 0, 0)),
            ((2, 0, 1), (0, -math.pi / 2, 0)),
            ((-2, 0, 1), (0, math.pi / 2, 0)),
        )
    ):
        sheet(scene, f"wall {number}", 3 * size, Vector(place) * size, turn, number)
    sheet(scene, "lamp 9", 0.5 * size, Vector((0, 0, 2.4)) * size, (math.pi, 0, 0), 9, emission=(8, 8, 8))
    data = bpy.data.cameras.new("camera")
    scene.camera = bpy.data.objects.new("camera", data)
    scene.camera.matrix_world = Matrix.LocRotScale(
        Vector((-1.2, 0, 1.2)) * size, Vector((1, 0, -0.1)).to_track_quat("-Z", "Y"), None
    )
    scene.collection.objects.link(scene.camera)
    scene[relight_room.ROOM_LIGHT] = 2.0
    bpy.context.view_layer.update()


def test_a_setup_lights_another_room_alike(scene, shoot):
    """A room twice as large: the same picture, as light and lengths go with the room."""
    build(scene, 1)
    lights.add_light(scene, "SOFTBOX")
    lights.add_light(scene, "SPOT", 0.5)
    lamps.set_factor(lamps.find_lamps(scene)[0], 0.25)
    before, told = shoot(scene, 32, 24, 64), setup.setup_of(scene)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    other = bpy.context.scene
    other.render.engine = "CYCLES"
    build(other, 2)
    setup.apply_setup(other, told)
    (lamp,) = lamps.find_lamps(other)
    assert lamps.factor(lamp) == pytest.approx(0.25) and len(lights.added_lights(other)) == 2
    assert np.median(shoot(other, 32, 24, 64)) == pytest.approx(np.median(before), rel=0.05)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"lights": [{"kind": 3}], "lamps": {}, "outside": null}'])
def test_what_is_no_setup_changes_nothing(scene, text):
    build(scene, 1)
    lights.add_light(scene, "SPOT")
    with pytest.raises(BadInputError, match="no light that was saved here"):
        setup.apply_setup(scene, text)
    assert len(lights.added_lights(scene)) == 1


def test_a_preset_is_blenders_own(package, scene, tmp_path):
    build(scene, 1)
    lights.add_light(scene, "SPOT")
    text = scene.scan_relight_studio.setup
    assert json.loads(text)["lights"][0]["kind"] == "SPOT"
    lights.remove_lights(scene)
    scene.scan_relight_studio.setup = text
    assert len(lights.added_lights(scene)) == 1


@pytest.mark.slow
def test_the_exposure_shows_middle_grey(scene, shoot):
    build(scene, 1)
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    scene.view_settings.exposure = 1.25
    asked = exposure.expose(scene)
    median = np.median(shoot(scene, 64, 48, 64) @ (0.2126, 0.7152, 0.0722))
    assert median * 2**asked == pytest.approx(0.18, rel=0.1) and scene.view_settings.exposure == pytest.approx(asked)
    lamps.set_factor(lamps.find_lamps(scene)[0], 0.25)
    assert exposure.measure(scene) == pytest.approx(asked + 2, abs=0.15)
    exposure.restore(scene)
    assert scene.view_settings.exposure == pytest.approx(1.25)
    lamps.set_on(lamps.find_lamps(scene)[0], False)
    with pytest.raises(BadInputError, match="No light reaches"):
        exposure.expose(scene)


def test_measuring_leaves_the_artists_render_alone(scene, tmp_path):
    build(scene, 1)
    scene.cycles.samples, scene.render.resolution_x, scene.render.resolution_y = 1, 16, 16
    bpy.ops.render.render()

    def rendered(name):
        image = next(one for one in bpy.data.images if one.type == "RENDER_RESULT")
        image.save_render(str(tmp_path / name))
        return (tmp_path / name).read_bytes()

    before = rendered("before.png")
    lamps.set_factor(lamps.find_lamps(scene)[0], 0.1)
    exposure.measure(scene)
    assert rendered("after.png") == before


def test_a_setup_keeps_colours_and_the_picture_around(room, tmp_path):
    from addon.core.io.exr import write_exr

    write_exr(tmp_path / "sky.exr", np.ones((8, 16, 3), np.float32))
    lamp = lamps.find_lamps(room)[0]
    recovered = room.world
    lamps.set_colour(lamp, (0.2, 0.4, 1.0))
    outside.use_hdri(room, tmp_path / "sky.exr", 2.0)
    outside.set_rotation(room.world, 0.5)
    told = setup.setup_of(room)
    setup.restore_captured(room)
    assert lamps.colour(lamp) != pytest.approx((0.2, 0.4, 1.0)) and room.world == recovered
    assert setup.apply_setup(room, told) == outside.remarks(room)
    assert lamps.colour(lamp) == pytest.approx((0.2, 0.4, 1.0))
    assert room.world != recovered and outside.rotation(room.world) == pytest.approx(0.5)
    (tmp_path / "sky.exr").unlink()
    assert "is gone" in setup.apply_setup(room, told)[0] and room.world == recovered


def test_one_volume_of_probes_covers_the_room(scene):
    build(scene, 1)
    probe.add_volume(scene)
    probe.add_volume(scene)  # renewed, not doubled
    (thing,) = probe.probes(scene)
    bpy.context.view_layer.update()
    corners = np.array([thing.matrix_world @ Vector(c) for c in ((-1, -1, -1), (1, 1, 1))])
    low, high = relight_room.bounds(scene)
    assert all(corners[0] <= low) and all(corners[1] >= high)
    assert probe.remove(scene) == 1 and not probe.probes(scene)
    other = bpy.data.scenes.new("another")
    with pytest.raises(BadInputError, match="Switch to scene 'another'"):
        probe.bake(other)
