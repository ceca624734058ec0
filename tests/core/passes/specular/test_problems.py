"""Which elements of an object are looked at."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.specular.problems import Problems
from addon.core.scene.samples import Samples
from tests.core.glossy_box import GLOW, Box

FLOOR = 0
FAINT = np.array([[0.5] * 3] * 6)


def small_lamp(box: Box, elements: int):
    """Whether each of the box's floor elements shows the lamp mirrored in a view, and a maker of their problems."""
    element, direction, frame = box.views(elements, 4)
    n = len(element)
    samples = Samples(
        element.astype(np.int32), frame.astype(np.int32), np.ones((n, 3), np.float32), direction, np.zeros(n, bool),
        np.zeros(n, np.float32),
    )  # fmt: skip
    mirrored = direction * [-1, -1, 1]
    shows = (box.arriving(box.room.atlas.position[element].astype(float), mirrored) == GLOW).all(1)
    return samples, set(element[shows]), {*element}


@pytest.mark.parametrize("without", [(), ("highlight-sampling",)])
def test_a_fit_looks_at_most_elements_that_show_a_lamp_mirrored(without):
    """One in fifty of 800 does; 40 are fitted."""
    box = Box(FAINT)
    samples, showing, every = small_lamp(box, 800)
    assert 10 < len(showing) < 20 < len(every)
    maker = Problems(box.field, samples, threads=2, without=without)
    to_fit, any_elements = (set(samples.element[maker.pick(FLOOR, 40, 4, to_fit=fitted)]) for fitted in (True, False))
    assert len(to_fit) == len(any_elements) == 40
    found = len(to_fit & showing) / len(showing)
    assert found < 0.3 if without else found > 0.8
    assert len(any_elements & showing) < 0.3 * len(showing)


def test_a_small_object_is_looked_at_whole():
    samples, _, every = small_lamp(Box(FAINT), 30)
    maker = Problems(Box(FAINT).field, samples, threads=2)
    assert set(samples.element[maker.pick(FLOOR, 40, 4, to_fit=True)]) == every
