"""Which elements of an object are looked at."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.passes.specular.problems import Problems
from addon.core.pipeline.choose_models import _by_frames
from addon.core.scene.samples import Samples
from addon.core.settings import Settings
from tests.core.fit.test_fit import paint
from tests.core.glossy_box import GLOW, Box

FLOOR = 0
FAINT = np.array([[0.5] * 3] * 6)


def small_lamp(box: Box, elements: int):
    """Views of some of the floor, the elements that show the lamp mirrored in one of them, and all elements."""
    element, direction, frame = box.views(elements, 4)
    n = len(element)
    samples = Samples(
        element.astype(np.int32), frame.astype(np.int32), np.ones((n, 3), np.float32), direction, np.zeros(n, bool),
        np.zeros(n, np.float32),
    )  # fmt: skip
    mirrored = direction * [-1, -1, 1]
    shows = (box.arriving(box.room.atlas.position[element].astype(float), mirrored) == GLOW).all(1)
    return samples, set(element[shows]), {*element}


def test_most_elements_that_show_a_lamp_mirrored_are_found():
    """One in fifty of 800 does; 40 are looked at."""
    box = Box(FAINT)
    samples, showing, every = small_lamp(box, 800)
    assert 10 < len(showing) < 20 < len(every)
    maker = Problems(box.field, samples, threads=2)
    expecting, any_elements = (
        set(samples.element[maker.pick(FLOOR, 40, 4, highlights=highlights)]) for highlights in (True, False)
    )
    assert len(expecting) == len(any_elements) == 40
    assert len(expecting & showing) > 0.8 * len(showing)
    assert len(any_elements & showing) < 0.3 * len(showing)


@pytest.mark.parametrize("psi", [0.04, 0.0])
def test_a_highlight_on_few_elements_is_found_where_it_is_expected(psi):
    """Noise of .5 hides it from most samples of all; what has none gets none."""
    box = Box(FAINT)
    element, direction, frame = box.views(1000, 4)
    clean, n = box.problem(element, direction, 0.03, psi, paint(element)).radiance, len(element)
    order = np.argsort(element, kind="stable")
    glossy = {"": 0, "highlight-sampling": 0}
    for seed in range(4):
        noise = np.exp(0.5 * np.random.default_rng(seed).normal(size=(n, 1)))
        samples = Samples(
            element[order].astype(np.int32), frame[order].astype(np.int32), (clean * noise).astype(np.float32)[order],
            direction[order], np.zeros(n, bool), np.zeros(n, np.float32),
        )  # fmt: skip
        maker = Problems(box.field, samples, threads=2)
        for without in glossy:
            settings = Settings(specular_rays=64, threads=2, without=(without,))
            room = SimpleNamespace(settings=settings, problems=maker)
            glossy[without] += _by_frames(room, FLOOR, False)[0].model is DIELECTRIC
    if psi:
        assert glossy["highlight-sampling"] < glossy[""] >= 3
    else:
        assert not any(glossy.values())


def test_a_small_object_is_looked_at_whole():
    samples, _, every = small_lamp(Box(FAINT), 30)
    maker = Problems(Box(FAINT).field, samples, threads=2)
    assert set(samples.element[maker.pick(FLOOR, 40, 4, highlights=True)]) == every
