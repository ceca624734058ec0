"""Lamps that the sensor clipped: solved for as if unseen where that gives more than frames show, else a lower bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light.environment import Environment
from addon.core.light.lamps import Lamp
from addon.core.light.shading import Shading
from addon.core.passes.clipped_lamps.clipped import shade_clipped
from addon.core.scene.lit_diffuse import LitDiffuse
from addon.core.scene.visibility import CLEAN
from tests.core.rooms import make_room, quad

WALL, BRIGHT, DIM, BOUND = 0, 1, 2, 4.0


@pytest.fixture
def room():
    corners = ((2.0 * i, 0.0, 0.0) for i in range(3))
    return make_room([quad(at, (1, 0, 0), (0, 1, 0), i) for i, at in enumerate(corners)], 0.2)


def shown(room, clipped=(BRIGHT, DIM)) -> LitDiffuse:
    lamp = np.isin(room.atlas.object_id, clipped)
    radiance = np.where(lamp[:, None], np.float32(BOUND), np.float32(1)) * np.ones((1, 3), np.float32)
    n = len(room.atlas)
    return LitDiffuse(
        radiance, np.zeros_like(radiance), np.full(n, 9, np.int32), np.full(n, CLEAN, np.int8), lamp.astype(np.float32)
    )


class Solver:
    """Stands for the shading: of objects that no frame saw it tells the luminances `solved`."""

    def __init__(self, room, solved):
        self.room, self.solved, self.asked = room, solved, []

    def __call__(self, lit, shining) -> Shading:
        ids = self.room.atlas.object_id
        self.asked.append((sorted(set(ids[~lit.seen].tolist())), sorted(shining)))
        lamps = [
            Lamp(i, np.full(3, self.solved[i], np.float32), False)
            if i in shining
            else Lamp(i, np.full(3, BOUND, np.float32), True)
            for i in (BRIGHT, DIM)
        ]
        n = len(ids)
        nothing = np.zeros((n, 3), np.float32)
        return Shading(nothing, nothing[:, 0], nothing[:, 0], nothing, tuple(lamps), Environment.dark(), (), (), 0)


def test_without_anything_clipped_the_light_is_found_once(room):
    solver = Solver(room, {})
    found = shade_clipped(solver, shown(room, ()), room.atlas)
    assert solver.asked == [([], [])] and not any(lamp.clipped for lamp in found.lamps)


def test_what_is_solved_for_was_hidden_and_says_that_it_was_clipped(room):
    solver = Solver(room, {BRIGHT: 30, DIM: 12})
    found = shade_clipped(solver, shown(room), room.atlas)
    assert solver.asked == [([BRIGHT, DIM], [BRIGHT, DIM])]
    assert [float(lamp.radiance[0]) for lamp in found.lamps] == [30, 12] and all(lamp.clipped for lamp in found.lamps)


def test_a_lamp_solved_below_its_bound_keeps_that_and_lights_the_others(room):
    solver = Solver(room, {BRIGHT: 30, DIM: 0.5 * BOUND})
    found = shade_clipped(solver, shown(room), room.atlas)
    assert solver.asked[1] == ([BRIGHT], [BRIGHT])  # the other one is there, as bright as frames show it
    assert [(float(lamp.radiance[0]), lamp.seen) for lamp in found.lamps] == [(30, False), (BOUND, True)]
    assert all(lamp.clipped for lamp in found.lamps)


def test_objects_that_are_left_to_the_shading_stay(room):
    solver = Solver(room, {BRIGHT: 30, DIM: 12})
    shade_clipped(solver, shown(room), room.atlas, but=[DIM])
    assert solver.asked == [([BRIGHT], [BRIGHT])]


def test_half_of_the_frames_tell_a_radiance(room):
    lit = shown(room)
    solver = Solver(room, {})
    shade_clipped(solver, replace(lit, clipped=lit.clipped / 2), room.atlas)
    assert solver.asked == [([], [])]
