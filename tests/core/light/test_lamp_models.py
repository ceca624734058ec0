"""Which lamps are of one model."""

from __future__ import annotations

from addon.core.light.lamps import lamp_models
from addon.core.scene.model import Instance
from tests.core.rooms import make_room, quad


def test_models_are_told_by_the_mesh():
    """Two of one size are one model, a larger one is another."""
    sides = [
        quad((x, 0, 0), (0, size, 0), (0, 0, size), i) for i, (x, size) in enumerate(((0, 0.1), (0.37, 0.1), (1, 0.2)))
    ]
    room = make_room(sides, 0.06)
    bulbs = tuple(Instance(i, "bulb") for i in range(3))
    assert lamp_models(room.mesh, bulbs) == {0: 0, 1: 0, 2: 2}
