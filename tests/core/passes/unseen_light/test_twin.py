"""When an unseen lamp is taken for a seen one of its model."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.lamps import Lamp
from addon.core.light.light_fit import Sample
from addon.core.passes.unseen_light.unseen_lamps import twin

MODEL = {1: 1, 2: 1, 3: 1, 4: 4}


def taken(texture: float, radiance: float, *seen: Lamp) -> Lamp | None:
    """Whom lamp 3 is taken for, of a luminance, on ten objects whose log albedo varies by `texture`."""
    rng = np.random.default_rng(0)
    object_id, contribution = np.repeat(np.arange(10, 20), 300), rng.lognormal(-1, 1, 3000)
    received, rho = np.ones(3000), rng.uniform(0.2, 0.6, 10).repeat(300) * rng.lognormal(0, texture, 3000)
    sent = rho * (received + radiance * contribution) / np.pi
    sample = Sample(np.arange(3000), object_id, sent[:, None].repeat(3, 1), received[:, None].repeat(3, 1))
    best = sample.best(sent, received, contribution)
    assert best is not None
    return twin(3, best[2], sample, sent, received, contribution, MODEL, list(seen))


def grey(object_id: int, luminance: float) -> Lamp:
    return Lamp(object_id, np.full(3, luminance, np.float32), True)


@pytest.mark.parametrize(("texture", "radiance", "expected"), [
    (0.1, 10.0, 1),  # it shines as that one does
    (0.1, 19.0, 2),  # nearer to the other
    (0.1, 60.0, None),  # plainly brighter than both
    (0.8, 30.0, 2),  # which the texture leaves open
])  # fmt: skip
def test_a_seen_lamp_of_its_model_unless_the_light_says_otherwise(texture, radiance, expected):
    found = taken(texture, radiance, grey(1, 10), grey(2, 20))
    assert (found and found.object_id) == expected


def test_none_of_another_model():
    assert taken(0.1, 10, grey(4, 10)) is None and taken(0.1, 10) is None
