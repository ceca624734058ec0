"""Watts and lumens of new lights."""

import math

import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.light import units  # noqa: E402
from addon.bridge.relight import lights  # noqa: E402
from addon.cli.relight import strength  # noqa: E402


@pytest.mark.parametrize("colour, lumens", [((1, 1, 1), 683), ((0, 1, 0), 683 * 0.7152), ((2, 2, 2), 1366)])
def test_a_watt_has_the_lumens_of_its_colour(colour, lumens):
    data = bpy.data.lights.new("lamp", "POINT")
    data.energy, data.color = 1.0, colour
    assert units.lumens(data) == pytest.approx(lumens, rel=1e-3)
    units.set_lumens(data, 100)
    assert data.energy == pytest.approx(100 / lumens, rel=1e-3)


def test_the_temperature_keeps_the_lumens(room):
    """Blender's own colours of temperatures have luminance 1."""
    for kelvin in (2700, 6500):
        light = lights.add_light(room, "SOFTBOX", 800, kelvin=kelvin, unit="LUMEN").data
        assert light.temperature == kelvin and light.energy == pytest.approx(800 / 683, rel=0.01)
    assert lights.add_light(room, "SPOT", 40, unit="WATT").data.energy == pytest.approx(40)


def test_a_point_of_light_throws_its_lumens(scene, shoot, look_down):
    """800 lm to all sides: 800 / (4 pi) candela, and so that many lux a metre away, straight on."""
    from tests.blender.relight.sheets import sheet

    sheet(scene, "floor", 6, (0, 0, 0), grey=0.5)
    look_down(0.05, 0.02)
    data = bpy.data.lights.new("lamp", "POINT")
    data.shadow_soft_size = 0.01
    units.set_lumens(data, 800)
    lamp = bpy.data.objects.new("lamp", data)
    lamp.location.z = 1
    scene.collection.objects.link(lamp)
    lux = 683 * shoot(scene, 8, 8, 64).mean() * math.pi / 0.5
    assert lux == pytest.approx(800 / (4 * math.pi), rel=0.03)


@pytest.mark.parametrize("text, told", [("0.5", (0.5, "ROOM")), ("20W", (20, "WATT")), ("800lm", (800, "LUMEN"))])
def test_the_command_line_takes_units(text, told):
    assert strength(text) == told


@pytest.mark.parametrize("text", ["W", "-3lm", "20kg", "nan"])
def test_what_is_no_strength(text):
    import argparse

    with pytest.raises(argparse.ArgumentTypeError):
        strength(text)
