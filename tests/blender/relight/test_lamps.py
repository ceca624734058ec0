"""The scan's lamps: off is gone, twice is twice, restored is exact."""

import json
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.bridge.light import lamps as lamps  # noqa: E402
from addon.bridge.scene.write import make_openings  # noqa: E402
from addon.core.errors import BadInputError  # noqa: E402
from addon.core.results.room_file import OPENINGS  # noqa: E402
from tests.blender.relight.sheets import sheet  # noqa: E402

DOWN = (math.pi, 0, 0)
WARM = (6.0, 3.0, 1.5)


def two_lamps(scene, one_sided):
    floor = sheet(scene, "floor", 4, (0, 0, 0))
    left = sheet(scene, "lamp", 0.5, (-1, 0, 2), DOWN, 3, WARM, one_sided)
    right = sheet(scene, "lamp", 0.5, (1, 0, 2), DOWN, 4, (1.0, 2.0, 4.0), one_sided)
    return floor, left, right


@pytest.mark.parametrize("one_sided", [False, True])
def test_off_takes_the_light_out_as_if_the_lamp_were_deleted(scene, shoot, look_down, one_sided):
    _, left, _ = two_lamps(scene, one_sided)
    look_down()
    # An absorber that the world behind it, black, can't be told from.
    lamps.principled(left.data.materials[0]).inputs["Base Color"].default_value = (0, 0, 0, 1)
    both = shoot(scene, 8, 8, 64)
    lamps.set_on(left.data.materials[0], False)
    off = shoot(scene, 8, 8, 64)
    bpy.data.objects.remove(left)
    gone = shoot(scene, 8, 8, 64)
    assert np.allclose(off.mean((0, 1)), gone.mean((0, 1)), rtol=0.03) and both.mean() > 1.5 * off.mean() > 0


def test_a_panel_in_an_opening_that_is_off_is_not_there(scene, shoot, look_down, tmp_path):
    sheet(scene, "floor", 4, (0, 0, 0))
    sheet(scene, "lamp", 2, (0, 0, 3), DOWN, 1, WARM)
    look_down()
    gone = shoot(scene, 8, 8, 64).mean((0, 1))
    quad = [[-3, -3, 2], [-3, 3, 2], [3, 3, 2], [3, -3, 2]]
    (tmp_path / OPENINGS).write_text(json.dumps({"openings": [{"radiance": [3, 3, 3], "corners": [quad]}]}))
    (panel,) = make_openings(tmp_path, scene.collection)
    on = shoot(scene, 8, 8, 64).mean((0, 1))
    lamps.set_on(panel.data.materials[0], False)
    off = shoot(scene, 8, 8, 64).mean((0, 1))
    assert np.allclose(off, gone, rtol=0.03) and (on > off + 0.5).all()
    lamps.restore(panel.data.materials[0])
    assert np.allclose(shoot(scene, 8, 8, 64).mean((0, 1)), on, rtol=1e-3)


def test_an_unlit_lamp_is_no_black_hole(scene, shoot, look_down):
    lamp = sheet(scene, "lamp", 2, (0, 0, 0), (0, 0, 0), 1, WARM)
    sheet(scene, "sky", 4, (0, 0, 3), DOWN, 2, (1.0, 1.0, 1.0))
    look_down()
    lamps.set_on(lamp.data.materials[0], False)
    lit = shoot(scene, 4, 4, 64).mean((0, 1))
    assert np.ptp(lit) < 1e-3 and 0.05 < lit.mean() < 0.5


@pytest.mark.parametrize("one_sided", [False, True])
def test_factor_two_doubles_its_light_and_no_other(scene, shoot, look_down, one_sided):
    _, left, right = two_lamps(scene, one_sided)
    look_down()
    lamps.set_on(right.data.materials[0], False)
    one = shoot(scene, 8, 8, 256).mean((0, 1))
    lamps.set_factor(left.data.materials[0], 2.0)
    two = shoot(scene, 8, 8, 256).mean((0, 1))
    assert np.allclose(two / one, 2, rtol=1e-3)
    assert lamps.radiance(left.data.materials[0]) == pytest.approx([2 * c for c in WARM])
    assert lamps.recovered_radiance(left.data.materials[0]) == pytest.approx(WARM)


@pytest.mark.parametrize("one_sided", [False, True])
def test_another_colour_is_what_arrives(scene, shoot, look_down, one_sided):
    _, left, right = two_lamps(scene, one_sided)
    look_down()
    lamps.set_on(right.data.materials[0], False)
    lamps.set_colour(left.data.materials[0], (0.0, 1.0, 0.25))
    seen = shoot(scene, 8, 8, 64).mean((0, 1))
    assert seen[0] == 0 and seen[2] == pytest.approx(seen[1] / 4, rel=1e-3) and seen[1] > 0


def every_value(material):
    tree = material.node_tree
    values = {
        (n.name, s.identifier): tuple(s.default_value) if hasattr(s.default_value, "__len__") else s.default_value
        for n in tree.nodes
        for s in n.inputs
        if hasattr(s, "default_value")
    }
    return values, len(tree.links), {key: material[key] for key in material.keys()}


@pytest.mark.parametrize("one_sided", [False, True])
def test_restored_is_exact(scene, one_sided):
    radiance = (0.1 + 0.2, 1 / 3, 7.77)
    material = sheet(scene, "lamp", 1, (0, 0, 2), DOWN, 3, radiance, one_sided).data.materials[0]
    before = every_value(material)
    assert not lamps.is_changed(material)
    for change in (
        lambda: lamps.set_factor(material, 0.37),
        lambda: lamps.set_colour(material, (1, 0, 0.5)),
        lambda: lamps.set_on(material, False),
    ):
        change()
        assert lamps.is_changed(material) and every_value(material) != before
    lamps.restore(material)
    assert every_value(material) == before and not lamps.is_changed(material)


def test_off_and_on_again_keeps_factor_and_colour(scene):
    material = sheet(scene, "lamp", 1, (0, 0, 2), DOWN, 3, WARM).data.materials[0]
    lamps.set_factor(material, 3)
    lamps.set_colour(material, (0.5, 1, 0))
    lamps.set_on(material, False)
    assert not lamps.is_on(material) and lamps.radiance(material) == (0, 0, 0)
    lamps.set_on(material, True)
    assert lamps.radiance(material) == pytest.approx((9, 18, 0))


def test_the_state_survives_saving(scene, tmp_path):
    sheet(scene, "lamp", 1, (0, 0, 2), DOWN, 3, WARM, True)
    lamps.set_factor(lamps.find_lamps(scene)[0], 0.5)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    (lamp,) = lamps.find_lamps(bpy.context.scene)
    assert lamps.factor(lamp) == 0.5
    lamps.restore(lamp)
    assert lamps.radiance(lamp) == pytest.approx(WARM)


def test_names_mean_one_lamp_or_a_class(scene):
    two_lamps(scene, False)
    assert [m.name for m in lamps.find_lamps(scene)] == ["lamp 3", "lamp 4"]
    assert len(lamps.lamp_named(scene, "Lamp")) == 2 and len(lamps.lamp_named(scene, "lamp 4")) == 1
    with pytest.raises(BadInputError, match="no lamp 'sun'; known are 'lamp 3', 'lamp 4'"):
        lamps.lamp_named(scene, "sun")
