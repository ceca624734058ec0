"""Radiances of several lights from the albedo's spread, and which elements can tell."""

from __future__ import annotations

import numpy as np

from addon.core.light.environment import EnvironmentAccumulator
from addon.core.light.light_fit import on_flat
from tests.core.light.test_environment import FAR_BELOW, add
from tests.core.rooms import look_at, make_room, quad


def test_flat_spots():
    room = make_room([quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0), quad((0, 0, 0), (1, 0, 0), (0, 0, 1), 0)], 0.02)
    flat, edge = on_flat(room.atlas), room.atlas.position[:, 1:].max(1)
    assert flat[edge > 0.1].all() and not flat[edge < 0.05].any()


def test_a_clipped_sky_is_a_bound_and_gives_way_to_what_is_not():
    room = make_room([FAR_BELOW], 0.5)
    accumulator = EnvironmentAccumulator(0.1)
    camera = look_at((0, 0, 0), (0, 5, 1), 20, 20)
    full, none = np.ones((20, 20), bool), np.zeros((20, 20), bool)
    half = full.copy()
    half[:, 10:] = False
    for value, saturated in ((4, full), (6, full), (9, half), (5, none & half)):
        image = np.full((20, 20, 3), value, np.float32)
        add(accumulator, room, camera, image, saturated=saturated, valid=full if value != 5 else ~half)
    environment = accumulator.result()
    clipped = environment.clipped
    assert clipped.any() and np.allclose(environment.radiance[clipped], 9)
    other = (environment.observations > 0) & ~clipped
    assert other.any() and np.allclose(environment.radiance[other].mean(), 7, atol=0.6)
    zone = next(zone for zone in environment.unknown_zones() if zone.clipped)
    assert (zone.weight[clipped] == 1).all() and not zone.weight[other].all()
    assert environment.with_zone(zone, np.float32([20] * 3)).clipped is clipped
