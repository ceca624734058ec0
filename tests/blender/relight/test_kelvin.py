"""Colour temperatures: as Blender's own, and the same light in another colour."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.light import kelvin as relight_kelvin  # noqa: E402
from addon.bridge.light import lamps  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402


@pytest.mark.parametrize("kelvin", [1800, 2700, 3200, 4000, 5500, 6500, 10000])
def test_it_is_what_blenders_lights_show(kelvin):
    light = bpy.data.lights.new("light", "AREA")
    light.use_temperature, light.temperature = True, kelvin
    assert np.allclose(relight_kelvin.rgb_of(kelvin), light.temperature_color, atol=0.01)
    assert relight_kelvin.kelvin_of(light.temperature_color) == pytest.approx(kelvin, rel=0.03)


def test_a_lamp_keeps_its_luminance(scene):
    sheet(scene, "lamp 1", 1, (0, 0, 0), emission=(6, 5, 4))
    (lamp,) = lamps.find_lamps(scene)
    before = np.array(lamps.radiance(lamp))
    lamps.set_kelvin(lamp, 2700)
    after = np.array(lamps.radiance(lamp))
    weights = (0.2126, 0.7152, 0.0722)
    assert after @ weights == pytest.approx(before @ weights, rel=1e-4)
    assert after[2] / after[0] < 0.15 and lamps.kelvin(lamp) == pytest.approx(2700, rel=0.01)
    lamps.restore(lamp)
    assert np.allclose(lamps.radiance(lamp), before)


def test_what_is_no_temperature_is_told():
    with pytest.raises(BadInputError, match="not 300 K"):
        relight_kelvin.rgb_of(300)
