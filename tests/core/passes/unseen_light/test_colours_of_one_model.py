"""Lamps of one model: one luminance, each lamp's own colour."""

from __future__ import annotations

import numpy as np

from addon.core.light.lamps import Lamp
from addon.core.luminance import LUMINANCE
from addon.core.passes.unseen_light.unseen_light import of_colour


def test_own_colour_at_the_luminance_of_all():
    lamp = Lamp(1, np.float32([9.0, 10.0, 11.0]), False, from_edges=True)
    warm = np.array([1.4, 0.95, 0.4])
    warm /= warm @ LUMINANCE
    found = of_colour(lamp, warm)
    np.testing.assert_allclose(found @ LUMINANCE, lamp.radiance @ LUMINANCE, rtol=1e-6)
    np.testing.assert_allclose(found / found[1], warm / warm[1], rtol=1e-6)


def test_what_is_known_otherwise_stays():
    twin = Lamp(1, np.float32([9.0, 10.0, 11.0]), False)
    assert of_colour(twin, np.ones(3)) is twin.radiance
    assert of_colour(Lamp(1, twin.radiance, False, from_edges=True), None) is twin.radiance
