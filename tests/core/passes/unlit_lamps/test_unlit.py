"""Which lamps are dark with their light off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.brdf.emitter import EMITTER, LAMP_ALBEDO
from addon.core.passes.specular.describe import lamp_material
from addon.core.passes.unlit_lamps.unlit import UNLIT, looks_outside, unlit
from addon.core.scene.model import Instance
from tests.core.rooms import around, box_sides, cut, make_room, quad

WALL, CEILING, LAMP = 2, 1, 6
PART = (0.3, 0.7), (0.3, 0.7)


def field_of(lamp, taken_from=None):
    """A box of 4 x 3 x 2.5 m with one more object; a piece of a side may be cut out for it."""
    sides = box_sides()
    if taken_from is not None:
        whole = sides.pop(taken_from)
        sides += around(whole, *PART)
    room = make_room([*sides, *lamp])
    return room.field(np.zeros((len(room.atlas), 3), np.float32))


def piece(side: int):
    found = cut(box_sides()[side], *PART)
    return quad(found.corner, found.edge_u, found.edge_v, LAMP)


def guess(instance, field):
    return unlit(instance, field, np.ones_like(field.radiance), np.ones(len(field.radiance), bool))


def box(low, high):
    """The six outer faces of a box."""
    (x, y, z), (X, Y, Z) = low, high
    u, v, w = (X - x, 0, 0), (0, Y - y, 0), (0, 0, Z - z)
    return [
        quad((x, y, z), v, u, LAMP), quad((x, y, Z), u, v, LAMP), quad((x, y, z), u, w, LAMP),
        quad((x, Y, z), w, u, LAMP), quad((x, y, z), w, v, LAMP), quad((X, y, z), v, w, LAMP),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "lamp, taken_from, outside",
    [
        ([piece(WALL)], WALL, True),
        (box((-0.03, 0.9, 0.8), (0, 2.1, 1.7)), WALL, True),  # a pane with a thickness
        ([piece(CEILING)], CEILING, False),
        (box((0.01, 0.9, 0.8), (0.05, 2.1, 1.7)), None, False),  # a screen before a wall
        (box((1.9, 1.4, 1.1), (2.1, 1.6, 1.3)), None, False),
    ],
    ids=["window", "thick window", "ceiling panel", "screen", "bulb"],
)
def test_what_stands_between_the_room_and_nothing_is_a_window(lamp, taken_from, outside):
    field = field_of(lamp, taken_from)
    assert looks_outside(LAMP, field) == outside
    albedo, why = guess(Instance(LAMP, "lamp"), field)
    assert (albedo == UNLIT.dark and "guess" in why) if outside else (albedo, why) == (None, "")


@pytest.mark.parametrize("name, dark", [("TV screen", True), ("window_2", True), ("sunscreen lamp", False)])
def test_a_class_may_say_so(name, dark):
    field = field_of(box((0.01, 0.9, 0.8), (0.05, 2.1, 1.7)))
    albedo, why = guess(Instance(LAMP, name), field)
    assert (albedo == UNLIT.dark and "guess" in why) if dark else albedo is None


def test_a_piece_of_a_wall_is_as_grey_as_the_rest_of_it():
    """In a mesh that tells of no objects, as wall beside a shade may be so bright that it is taken for a lamp."""
    field = field_of([piece(WALL)], WALL)
    beside = field.atlas.object_id == WALL
    field = field.with_light(np.where(beside, 0.7, 0.2)[:, None].repeat(3, 1), field.environment)
    irradiance, told = np.full_like(field.radiance, np.pi), field.atlas.object_id != LAMP
    lamp = Instance(LAMP, "lamp")
    assert unlit(lamp, field, irradiance, told)[0] == UNLIT.dark
    field.mesh = replace(field.mesh, whole=True)
    albedo, why = unlit(lamp, field, irradiance, told)
    assert albedo == pytest.approx(0.7) and "guess" in why
    assert unlit(lamp, field, irradiance, told & ~beside)[0] == UNLIT.dark
    assert unlit(Instance(LAMP, "screen"), field, irradiance, told)[0] == UNLIT.dark


def test_it_gives_of_itself_what_it_does_not_reflect():
    radiance, irradiance = np.array([3.0, 2.0, 1.0]), np.full((4, 3), np.pi)
    for albedo, shown in ((None, LAMP_ALBEDO), (0.02, 0.02)):
        found = lamp_material(Instance(LAMP, "lamp"), radiance, irradiance, "", albedo)
        assert np.allclose(np.add(found.emission, shown), radiance)
        assert EMITTER.principled(found).base_color == pytest.approx([shown] * 3)
