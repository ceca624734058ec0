"""What the panel Correct shows of the active object, and that every button and value in it is there."""

import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.artist.corrected_room import BOARD, LAMP, TABLE, TAP, build, select  # noqa: E402


@pytest.fixture
def room(ops, tmp_path, module):
    module("addon.bridge.corrections.corrections").forget()
    bpy.context.scene.scan_relight_correct.refit_automatically = False
    return build(tmp_path / "result")


@pytest.fixture
def panels(module):
    found = module("operators.correct.panel")
    return [getattr(found, f"SCAN_RELIGHT_PT_correct{name}") for name in ("", "_scale", "_unseen", "_smooth")]


def test_only_for_a_recovered_object(room, panels):
    select(room[BOARD])
    assert panels[0].poll(bpy.context)
    bpy.context.view_layer.objects.active = None
    assert not panels[0].poll(bpy.context)


@pytest.mark.parametrize(
    "number, rows",
    [
        (BOARD, {"Model", "Base Color"}),
        (TABLE, {"Model", "Roughness", "F0", "Base Color"}),
        (TAP, {"Model", "Roughness", "F0 Color"}),
        (LAMP, {"Model"}),
    ],
)
def test_each_model_has_its_values(room, panels, draw, number, rows):
    select(room[number])
    words = draw(panels[0]).words
    assert {"Model", "Roughness", "F0", "F0 Color", "Base Color"} & set(words) == rows
    assert {"Metal", "Glossy", "Diffuse", "Lamp", "The Same As", "Refit"} <= set(words)


def test_what_is_given_and_waits_is_told(room, panels, draw, ops):
    select(room[BOARD], room[TABLE])
    shown = draw(panels[0])
    assert "All Selected" in shown.words and "Refit fits the rest" not in shown.text
    ops.same_as()
    select(room[BOARD])
    shown = draw(panels[0], width=900)
    assert f"The same as {room[TABLE].name}" in shown.words and "Shown as given; Refit fits the rest" in shown.text


def test_the_other_parts(room, panels, draw, ops):
    select(room[BOARD])
    ops.this_is_white(albedo=(0.8, 0.8, 0.8))
    ops.fill_unseen()
    words = [word for panel in panels[1:] for word in draw(panel).words]
    assert f"{room[BOARD].name}: 0.80, 0.80, 0.80" in words and "Whole Room" in words
    assert any("painted" in word for word in words)
