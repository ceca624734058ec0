"""Lamps and skies solved for once more, all together."""

import numpy as np
import pytest

from addon.core.light.lamps import Lamp
from addon.core.light.light_fit import Sample
from addon.core.luminance import LUMINANCE
from addon.core.passes.unseen_light.sky import Sky
from addon.core.passes.unseen_light.unseen_lamps import solve_together
from tests.core.rooms import make_room, quad

LAMP, SKY, TWIN, SUN = np.array([9.0, 7.0, 5.0]), np.array([2.0, 2.2, 2.6]), np.full(3, 6.0), np.array([7.0, 6.0, 5.0])


def solved(
    told: float,
    share: float = 0.5,
    lower: float = 0.1,
    by_lamp: float = 0.5,
    clipped_at: np.ndarray | None = None,
    sun: float = 0.0,
    measured: tuple[bool, bool, bool] = (False, False, False),
) -> tuple[list[Lamp], Sky, np.ndarray]:
    """A floor of two paints under a lamp, one like a seen one, and a part of the sky; the first and last `told`.

    And one end under a sun, which was measured so many times as strong (0: there is none).
    """
    room = make_room([quad((0, 0, 0), (4, 0, 0), (0, 3, 0), 0)], 0.1)
    x, y = room.atlas.position[:, 0], room.atlas.position[:, 1]
    m, rng = len(x), np.random.default_rng(3)
    base, at_lamp, at_twin = np.full((m, 3), 1.0), by_lamp * (x < 1.5), 0.2 * (x > 2.5)
    at_sky = share * (y < 1)
    by_sun = ((x > 2) & (y > 2))[:, None, None] * np.ones((1, int(sun > 0), 3)) * SUN
    E = base + at_lamp[:, None] * LAMP + at_twin[:, None] * TWIN + at_sky[:, None] * SKY + by_sun.sum(1)
    albedo = np.where(((x // 0.5 + y // 0.5) % 2)[:, None] > 0, 0.3, 0.6) * np.exp(rng.normal(0, 0.03, (m, 1)))
    sample, base = Sample(np.arange(m), np.zeros(m, int), albedo * E / np.pi, base), base + sun * by_sun.sum(1)
    lamps = [Lamp(1, told * LAMP, False), Lamp(2, TWIN, False, twin=5)]
    sky = Sky([at_sky], [lower * SKY], [True], [True])
    sky.radiance = [np.maximum(told, lower) * SKY]
    bounds = {} if clipped_at is None else {1: clipped_at}
    contribution = {1: at_lamp, 2: at_twin}
    lamps, factor = solve_together(
        sample, room.atlas, lamps, contribution, sky, base, bounds, sun * by_sun, np.array(measured), 0
    )
    return lamps, sky, factor


@pytest.mark.parametrize("told", [0.6, 1.0, 1.6])
def test_they_come_nearer_to_the_truth(told):
    lamps, sky, _ = solved(told)
    by_id = {lamp.object_id: lamp.radiance for lamp in lamps}
    assert by_id[1] == pytest.approx(LAMP, rel=0.15) and sky.radiance[0] == pytest.approx(SKY, rel=0.15)
    assert by_id[2].tolist() == TWIN.tolist() and sky.solved == {0}


def test_a_clipped_lamp_is_no_darker_than_it_was_seen():
    lamps, *_ = solved(1.0, clipped_at=1.5 * LAMP)
    assert (lamps[0].radiance >= 1.5 * LAMP * (1 - 1e-6)).all()


def test_a_clipped_lamp_that_lights_next_to_nothing_has_the_colour_at_which_it_was_clipped():
    lamps, *_ = solved(1.0, by_lamp=1e-5, clipped_at=np.ones(3))
    assert lamps[0].radiance == pytest.approx(np.full(3, LUMINANCE @ LAMP), rel=0.05)


def test_a_clipped_sky_is_no_darker_than_it_was_seen():
    _, sky, _ = solved(1.0, lower=1.5)
    assert (sky.radiance[0] >= 1.5 * SKY).all()


def test_a_sky_that_lights_next_to_nothing_stays():
    _, sky, _ = solved(0.5, share=1e-4)
    assert sky.radiance[0].tolist() == (0.5 * SKY).tolist() and not sky.solved


def test_where_nothing_is_unknown_all_stays():
    sample = Sample(np.arange(4), np.zeros(4, int), np.ones((4, 3)), np.ones((4, 3)))
    twin, sky = Lamp(2, TWIN, False, twin=5), Sky([], [], [], [])
    room = make_room([quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0)], 0.5)
    E, no_sun = np.ones((4, 3)), np.zeros((4, 0, 3))
    lamps, factor = solve_together(
        sample, room.atlas, [twin], {2: np.ones(4)}, sky, E, {}, no_sun, np.zeros(3, bool), 0
    )
    assert lamps == [twin] and not sky.solved and factor.tolist() == [1, 1, 1]


@pytest.mark.parametrize("sun", [0.4, 0.6, 1.0])
def test_a_sun_of_which_a_lower_bound_is_known_is_as_strong_as_it_lights_the_room(sun):
    lamps, sky, factor = solved(1.0, sun=sun)
    assert sun * factor == pytest.approx(np.ones(3), rel=0.15)
    assert lamps[0].radiance == pytest.approx(LAMP, rel=0.15) and sky.radiance[0] == pytest.approx(SKY, rel=0.15)


def test_a_sun_is_no_weaker_than_its_lower_bound():
    assert (solved(1.0, sun=1.5)[2] >= 1 - 1e-6).all()


def test_a_channel_of_the_sun_that_is_measured_stays_and_the_others_are_likely_alike():
    *_, factor = solved(1.0, sun=0.6, measured=(False, False, True))
    assert factor[2] == pytest.approx(1) and (factor[:2] < solved(1.0, sun=0.6)[2][:2]).all()
