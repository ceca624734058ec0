"""What others of its class say of an object's model."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.brdf.dielectric import DIELECTRIC
from addon.core.brdf.lambertian import LAMBERTIAN
from addon.core.passes.specular.models import choose_model
from addon.core.pipeline.choose_models import Looked, Room, choose_models
from addon.core.scene.model import Instance
from tests.core.fit.test_fit import paint
from tests.core.glossy_box import Box


@pytest.mark.parametrize("guess", [False, True])
def test_a_class_that_shape_alone_tells_shares_no_lobe(guess):
    """A glossy wall, and one whose few frames tell no lobe: alike if the capture told that they are of a class."""
    box = Box()
    element, direction, _ = box.views(60, 10)
    glossy = box.problem(element, direction, 0.11, 0.08, paint(element))
    few = np.isin(element, np.unique(element)[:5])
    looked = {i: Looked(choose_model(one), one, -1) for i, one in enumerate((glossy, glossy.part(few)))}
    instances = tuple(Instance(i, "wall", guess=guess) for i in looked)
    room = Room(instances, None, None, None, None, [])
    models = [choice.model for choice in choose_models(room, looked).choices.values()]
    assert models == [DIELECTRIC, LAMBERTIAN if guess else DIELECTRIC]
