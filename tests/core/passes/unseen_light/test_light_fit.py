"""Radiances of several lights from the albedo's spread, and which elements can tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light.environment import EnvironmentAccumulator
from addon.core.light.lamps import Lamp
from addon.core.light.light_fit import Sample, kinds_of, on_flat
from addon.core.passes.unseen_light.refine_light import Sky, refined, shared_by_class
from addon.core.scene.model import Instance
from tests.core.light.test_environment import FAR_BELOW, add
from tests.core.rooms import look_at, make_room, quad

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
TRUE = np.array([[20.0, 18.0, 15.0], [1.0, 1.2, 1.5]])


def sample(noise: float = 0.1, seed: int = 0):
    """Three objects under known light, a lamp and a part of the sky; a tenth of the elements are something else."""
    rng = np.random.default_rng(seed)
    m = 1500
    object_id = rng.integers(0, 3, m)
    base = rng.uniform(0.2, 1, (m, 1)) * np.array([1, 0.9, 0.8])
    contribution = rng.exponential(0.05, m), rng.exponential(0.5, m)
    E = base + contribution[0][:, None] * TRUE[0] + contribution[1][:, None] * TRUE[1]
    albedo = np.array([0.2, 0.5, 0.8])[object_id] * np.exp(rng.normal(0, noise, m))
    albedo[rng.random(m) < 0.1] *= 3
    return Sample(np.arange(m), object_id, albedo[:, None] * E / np.pi, base), base, contribution


@pytest.mark.parametrize("bound", [False, True])
def test_a_lamp_and_the_sky_are_refined_together(bound):
    found, base, (lamp_light, sky_light) = sample()
    sky = Sky([sky_light], [TRUE[1] * (0.8 if bound else 2)], [bound], [False])
    sky.solved.add(0)
    start = Lamp(7, np.float32([12, 12, 12]), False, spread=(0.5, 0.4))
    lamps = refined(found, [start], {7: lamp_light}, {7: 0.1}, {}, [], sky, base, {})
    assert np.allclose(lamps[0].radiance, TRUE[0], rtol=0.08) and lamps[0].spread == (0.5, 0.4)
    assert np.allclose(sky.radiance[0], TRUE[1], rtol=0.1)
    assert ("clipped" in sky.notes()[0]) == bound


def test_a_known_colour_is_kept():
    """The lamp's from its edges: only its luminance is solved for, and the sky gets what is left."""
    found, base, (lamp_light, sky_light) = sample()
    sky = Sky([sky_light], [TRUE[1] * 2], [False], [False])
    sky.solved.add(0)
    told = TRUE[0] / (TRUE[0] @ LUMINANCE)
    start = Lamp(7, np.float32(12 * told), False, spread=(0.5, 0.4))
    (lamp,) = refined(found, [start], {7: lamp_light}, {7: 0.1}, {}, [], sky, base, {7: told})
    np.testing.assert_allclose(lamp.radiance / (lamp.radiance @ LUMINANCE), told, rtol=1e-5)
    assert lamp.radiance @ LUMINANCE == pytest.approx(TRUE[0] @ LUMINANCE, rel=0.08)
    assert np.allclose(sky.radiance[0], TRUE[1], rtol=0.1)


def test_a_colour_is_shared_by_a_class():
    instances = (Instance(1, "lamp"), Instance(2, "lamp"), Instance(3, "wall"))
    shared = shared_by_class({1: TRUE[0]}, [1, 2, 3], instances)
    assert sorted(shared) == [1, 2] and (shared[2] == TRUE[0]).all()


def test_a_lower_bound_holds():
    found, base, (lamp_light, sky_light) = sample()
    sky = Sky([sky_light], [2 * TRUE[1]], [True], [False])
    sky.solved.add(0)
    refined(found, [Lamp(7, np.float32(TRUE[0]), False)], {7: lamp_light}, {7: 0.1}, {}, [], sky, base, {})
    assert (sky.radiance[0] >= 2 * TRUE[1] - 1e-6).all()


def test_nothing_to_refine():
    found, base, _ = sample()
    assert refined(found, [], {}, {}, {}, [], Sky([], [], [], []), base, {}) == []


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


def test_kinds_are_objects_of_one_class_and_paint():
    """0 and 1 alike, 2 of another colour, 3 much darker; 4 alike but of another class, 5 alone in its own."""
    same = [0.5, 0.4, 0.3]
    albedo = np.log([same, [0.55, 0.44, 0.33], [0.5, 0.4, 0.4], [0.2, 0.16, 0.12], same, [1, 1, 1]])
    class_of = dict.fromkeys(range(4), "wall") | {4: "floor", 5: "door"}
    ids = np.repeat(np.arange(6), 30)
    kind = kinds_of(ids, albedo[ids] + np.random.default_rng(0).normal(0, 0.05, (180, 1)), class_of)
    first = kind[::30]
    assert first[0] == first[1] and len(set(first.tolist())) == 5
    assert (kind == np.repeat(first, 30)).all()
    assert len(set(kinds_of(ids, albedo[ids], dict.fromkeys(range(6), "thing")).tolist())) == 6
    assert len(set(kinds_of(ids, albedo[ids], {}).tolist())) == 6


def test_objects_of_a_kind_tell_of_the_lamp_that_lights_one_of_them():
    """Each has the same light all over, so neither tells by itself."""
    rng = np.random.default_rng(1)
    ids, m = np.repeat([0, 1], 200), 400
    contribution = np.where(ids == 0, 1e-6, 0.1)
    received = np.ones(m)
    sent = 0.5 / np.pi * (received + 20 * contribution) * np.exp(rng.normal(0, 0.1, m))
    how = sent, received, contribution[:, None], np.array([30.0]), np.array([0.1]), np.array([1e3])
    alone = Sample(np.arange(m), ids, sent[:, None].repeat(3, 1), received[:, None].repeat(3, 1))
    together = replace(alone, kind=np.zeros(m, int))
    assert together.refine(*how)[0] == pytest.approx(20, rel=0.05)
    assert alone.refine(*how)[0] > 30


def test_heavy_objects_do_not_outweigh_the_median():
    """An object of many elements counts for `most` of them in the median of its kind, too."""
    ids = np.repeat([0, 1, 2], [30, 30, 600])
    log_albedo = np.repeat([0.0, 0.1, 0.2], [30, 30, 600])
    one = Sample(np.arange(660), ids, np.ones((660, 3)), np.ones((660, 3)), 30.0, np.zeros(660, int))
    assert one.spread(log_albedo) == pytest.approx((0.1 + 0 + 0.1) / 3 / 2, abs=1e-9)
