"""Light of unseen lamps by way of the insides of their shades, against radiosity."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.few_elements import contribution_of_object, evened
from addon.core.light.lamps import Lamp
from addon.core.passes.unseen_light.shades import by_way_of_shade
from tests.core.rooms import lit_box, make_room, radiosity

FLOOR, LAMP, PAPER, DIM = 0, 6, 0.4, 1e-3
"""The shade is all but the floor of a box; `DIM` is the floor's albedo, next to none."""


@pytest.fixture(scope="module")
def shade():
    return make_room(lit_box((3.6, 3.0, 2.4), (((0.2, 0.8), (0.2, 0.8)),)), 0.15)


@pytest.fixture(scope="module")
def floor(shade):
    own = np.flatnonzero(shade.atlas.object_id == FLOOR)
    return own[np.linspace(0, len(own) - 1, 40).astype(int)]


def contribution(shade, floor, radiance, brightness=1.0, albedo=PAPER):
    lamp = Lamp(LAMP, np.full(3, brightness, np.float32), False)
    known, field = {i: albedo for i in range(1, 6)}, shade.field(radiance)
    return by_way_of_shade(field, lamp, known, evened(field), floor, seed=0)


def test_what_comes_by_way_of_the_shade(shade, floor):
    dark = shade.by_object({FLOOR: 0.01})
    paint = {i: PAPER for i in range(1, 6)} | {FLOOR: DIM, LAMP: 0.0}
    truth = np.pi * radiosity(shade, paint, {LAMP: 1.0}, 8)[floor, 0] / DIM
    direct = contribution_of_object(shade.field(dark), floor, LAMP, 0)
    found = contribution(shade, floor, dark)
    assert found.mean() == pytest.approx((truth - direct).mean(), rel=0.06)
    assert found == pytest.approx(truth - direct, rel=0.2)
    assert contribution(shade, floor, dark, albedo=2 * PAPER).mean() > 2.5 * found.mean(), "light goes to and fro"


def test_what_was_seen_counts_already(shade, floor):
    lit = shade.by_object({i: 0.01 for i in range(6)})
    assert not contribution(shade, floor, lit).any()


def test_a_dim_lamp_adds_nothing_to_what_is_taken_for_seen(shade, floor):
    """Half of each wall was seen, as bright as this lamp makes the other."""
    half = shade.by_object({i: 0.1 for i in range(6)})
    half[(shade.atlas.position[:, 2] < 1.2) & (shade.atlas.object_id != FLOOR)] = 0
    assert not contribution(shade, floor, half, brightness=0.5).any()
    assert contribution(shade, floor, half, brightness=50.0).any()
