"""What unseen surfaces send while light is solved for: a shelf over a worktop, of which no frame saw the underside."""

from __future__ import annotations

import numpy as np

from addon.core.light.few_elements import filled_radiance, irradiance_at
from addon.core.pipeline.unseen_surfaces import with_unseen_by_light
from tests.core.rooms import box_sides, make_room, quad

LAMP, SHELF, LAMP_AT = 7, 6, (1.6, 1.3, 2.45)
HOW = {"finest": 0.05, "smooth": True, "threads": 2, "seed": 0}


def room():
    """A lamp under the ceiling, and a shelf 40 cm over the floor: its top and front, and its underside."""
    shelf = [
        quad((0.5, 0.5, 0.5), (2, 0, 0), (0, 1.5, 0), SHELF),
        quad((0.5, 0.5, 0.4), (0, 1.5, 0), (2, 0, 0), SHELF),
        quad((2.5, 0.5, 0.4), (0, 1.5, 0), (0, 0, 0.1), SHELF),
    ]
    return make_room([*box_sides(), *shelf, quad(LAMP_AT, (0, 0.5, 0), (0.5, 0, 0), LAMP)], 0.2)


def lit(one):
    """Radiance by bounces, of an albedo of .6."""
    everything, lamp = np.arange(len(one.atlas)), one.atlas.object_id == LAMP
    radiance = one.by_object({LAMP: (30, 30, 30)})
    for bounce in range(4):
        E = irradiance_at(one.field(radiance).with_light(radiance, lamps=[LAMP]), everything, bounce)
        radiance = np.where(lamp[:, None], np.float32(30), np.float32(0.6 / np.pi) * E).astype(np.float32)
    return radiance


def test_an_underside_sends_in_proportion_to_the_light_that_reaches_it():
    one = room()
    true = lit(one)
    below = (one.atlas.object_id == SHELF) & (one.atlas.normal[:, 2] < -0.9)
    field = one.field(np.where(below[:, None], np.float32(0), true))
    found = filled_radiance(with_unseen_by_light(field, ~below, **HOW))
    assert np.array_equal(found[~below], true[~below])
    as_its_top = np.median(filled_radiance(field)[below] / true[below])
    assert as_its_top > 3  # what it would be without
    assert abs(np.median(found[below] / true[below]) - 1) < 0.3


def test_what_was_seen_whole_or_not_at_all_stays_as_it_is():
    one = room()
    true = lit(one)
    field = one.field(true)
    assert np.array_equal(filled_radiance(with_unseen_by_light(field, np.ones(len(true), bool), **HOW)), true)
    unseen = one.atlas.object_id == SHELF
    field = one.field(np.where(unseen[:, None], np.float32(0), true))
    assert not filled_radiance(with_unseen_by_light(field, ~unseen, **HOW))[unseen].any()


def test_the_unseen_side_of_a_lamp_shines_as_its_seen_side():
    one = room()
    true = lit(one)
    half = (one.atlas.object_id == LAMP) & (one.atlas.position[:, 0] > LAMP_AT[0] + 0.25)
    below = (one.atlas.object_id == SHELF) & (one.atlas.normal[:, 2] < -0.9)
    field = one.field(np.where((half | below)[:, None], np.float32(0), true))
    found = filled_radiance(with_unseen_by_light(field, ~half & ~below, **HOW))
    assert half.any() and np.allclose(found[half], 30)
