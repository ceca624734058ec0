"""Lamps that nobody saw shine, beside a sky that is there: believed in only where the sky alone explains less."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.lamps import Lamp
from addon.core.light.light_fit import Sample
from addon.core.passes.unseen_light.sky import Sky
from addon.core.passes.unseen_light.unseen_lamps import needed

M, LAMP = 600, 9
BASE = np.full((M, 3), 0.5)
FROM_SKY = np.linspace(0.05, 1, M)[np.random.default_rng(0).permutation(M)]
FROM_LAMP = np.random.default_rng(1).uniform(0, 1, M) ** 3


def solved(sky: float, lamp: float, wrong_sky: float, wrong_lamp: float, shining=()):
    """What is kept of a lamp and a sky that were taken for something else than they are."""
    rng = np.random.default_rng(2)
    albedo = np.array([0.2, 0.5, 0.7, 0.4])[np.arange(M) % 4] * np.exp(rng.normal(0, 0.02, M))
    received = 0.5 + sky * FROM_SKY + lamp * FROM_LAMP
    sample = Sample(np.arange(M), np.arange(M) % 4, (albedo * received)[:, None] * np.ones(3), BASE)
    found = Sky([FROM_SKY], [np.full(3, 2.5)], [False], [False])
    found.radiance[0] = np.full(3, wrong_sky)
    lamps = [Lamp(LAMP, np.full(3, wrong_lamp, np.float32), False)]
    return needed(sample, lamps, {LAMP: FROM_LAMP}, found, BASE, shining)


def test_a_lamp_that_the_sky_alone_makes_needless_goes():
    lamps, sky = solved(sky=3.0, lamp=0.0, wrong_sky=2.9, wrong_lamp=0.03)
    assert not lamps
    assert sky.radiance[0] == pytest.approx(np.full(3, 3.0), rel=0.05)


def test_a_lamp_that_lights_the_room_stays():
    lamps, sky = solved(sky=3.0, lamp=4.0, wrong_sky=3.0, wrong_lamp=4.0)
    assert [lamp.object_id for lamp in lamps] == [LAMP] and np.allclose(sky.radiance[0], 3.0)


def test_a_lamp_that_was_seen_to_shine_stays_in_any_case():
    lamps, _ = solved(sky=3.0, lamp=0.0, wrong_sky=2.9, wrong_lamp=0.03, shining=[LAMP])
    assert len(lamps) == 1
