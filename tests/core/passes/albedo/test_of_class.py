"""Objects of one class: of one paint their levels come together, of several they stay apart."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.albedo.of_class import shrunk_to_class
from tests.core.rooms import make_room, quad

PANELS = 12


@pytest.fixture(scope="module")
def atlas():
    """A large wall, object 0, and panels of .2 square metres."""
    panels = [quad((0.5 * i, 0, 0), (0.4, 0, 0), (0, 0.5, 0), i + 1) for i in range(PANELS)]
    return make_room([quad((0, 0, 1), (6, 0, 0), (0, 3, 0), 0), *panels], 0.1).atlas


def levels(atlas, colours, class_of=None, measured=None):
    """Each object's albedo afterwards, (PANELS + 1, 3), where each had one colour."""
    rho = np.float32(colours)[atlas.object_id]
    measured = np.ones(len(rho), bool) if measured is None else measured
    told = dict.fromkeys(range(PANELS + 1), "panel") if class_of is None else class_of
    result = shrunk_to_class(atlas, rho, measured, told)
    return np.array([result[atlas.elements_of(i)].mean(0) for i in range(PANELS + 1)])


def painted(levels):
    return np.repeat(np.concatenate([[0.5], levels])[:, None], 3, 1)


def test_of_one_paint_they_come_together(atlas):
    off = np.random.default_rng(0).normal(0, 0.05, PANELS)
    found = levels(atlas, painted(0.5 * np.exp(off)))
    assert np.abs(np.log(found[1:] / 0.5)).mean() < 0.3 * np.abs(off).mean()
    assert np.abs(np.log(found[0] / 0.5)).max() < 0.02


def test_of_several_paints_they_stay(atlas):
    colours = painted(np.tile([0.1, 0.3, 0.6, 0.9], PANELS // 4))
    assert np.allclose(levels(atlas, colours), colours, rtol=0.02)


def test_paints_of_one_level_stay_as_they_are(atlas):
    """Red and blue of the same mean, each off a little: their levels are told by themselves."""
    red, blue = np.array([0.8, 0.2, 0.1]), np.array([0.1, 0.2, 0.8])
    colours = np.array([red if i % 2 else blue * 1.1 for i in range(PANELS + 1)])
    assert np.allclose(levels(atlas, colours), colours, rtol=0.02)


def test_each_class_by_itself_and_nothing_of_what_nobody_told(atlas):
    colours = painted(np.linspace(0.45, 0.55, PANELS))
    class_of = {i: "door" if i == 5 else "panel" for i in range(1, 9)}
    found = levels(atlas, colours, class_of)
    assert np.allclose(found[[0, 5, 9, 10, 11, 12]], colours[[0, 5, 9, 10, 11, 12]], rtol=1e-5)
    assert np.ptp(found[[1, 2, 3, 4, 6, 7, 8]], 0).max() < 0.5 * np.ptp(colours[1:9], 0).max()


def test_the_level_is_that_of_what_was_measured(atlas):
    colours, odd = painted(np.full(PANELS, 0.5)), np.arange(len(atlas)) % 2 > 0
    rho = np.where(odd[:, None], np.float32(0.01), np.float32(colours)[atlas.object_id])
    told = dict.fromkeys(range(PANELS + 1), "panel")
    assert np.allclose(shrunk_to_class(atlas, rho, ~odd, told), rho)
    assert np.allclose(shrunk_to_class(atlas, rho, np.zeros(len(rho), bool), told), rho)
