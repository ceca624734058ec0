"""Which lamps are of one model."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.lamps import lamp_kinds, radius_of_gyration
from addon.core.scene.model import Instance, Mesh
from tests.core.rooms import make_room, quad

CLASSES = tuple(Instance(i, "bulb") for i in range(3))


def balls(radii: list[float], noise: float = 0.0) -> Mesh:
    """Balls of 12 by 24 sides in a row, vertices moved along their normals."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 13), np.arange(24) * np.pi / 12, indexing="ij")
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    i, k = (x.ravel() for x in np.meshgrid(np.arange(12), np.arange(24), indexing="ij"))
    a, b, c, d = 24 * i + k, 24 * i + (k + 1) % 24, 24 * (i + 1) + (k + 1) % 24, 24 * (i + 1) + k
    faces = np.concatenate([np.stack(t, 1) for t in ((a, b, c), (a, c, d))])
    rng = np.random.default_rng(1)
    points = [
        unit * (r + noise * rng.standard_normal((len(unit), 1))) + (np.float64(at), 0, 0) for at, r in enumerate(radii)
    ]
    number = np.repeat(np.arange(len(radii)), len(faces)).astype(np.int32)
    triangles = np.concatenate([faces + at * len(unit) for at in range(len(radii))]).astype(np.int32)
    return Mesh(np.concatenate(points).astype(np.float32), triangles, number)


def test_models_are_told_by_the_mesh():
    """Two of one size are one model, a larger one is another."""
    sides = [
        quad((x, 0, 0), (0, size, 0), (0, 0, size), i) for i, (x, size) in enumerate(((0, 0.1), (0.37, 0.1), (1, 0.2)))
    ]
    room = make_room(sides, 0.06)
    assert lamp_kinds(room.mesh, CLASSES).model == {0: 0, 1: 0, 2: 2}


def test_of_another_class_is_another_model():
    """What looks alike is one lamp only where the capture calls it the same; without a class nothing is."""
    mesh = balls([0.05, 0.05, 0.05])
    told = (Instance(0, "bulb"), Instance(1, "spot"), Instance(2, ""))
    assert lamp_kinds(mesh, told).model == {0: 0, 1: 1, 2: 2}
    assert lamp_kinds(mesh, told).classes() == {"bulb": [0], "spot": [1]}


def test_noise_of_a_scan_leaves_one_model():
    """A scan that is off by millimetres along the normals makes bulbs larger or smaller."""
    mesh = balls([0.040, 0.045, 0.080], noise=0.003)
    assert lamp_kinds(mesh, CLASSES).model == {0: 0, 1: 1, 2: 2}
    assert lamp_kinds(mesh, CLASSES, noise=0.004).model == {0: 0, 1: 0, 2: 2}


def test_radius_of_gyration():
    """That of a sphere is its radius; a tenth of noise changes it by hundredths, where the area grows by a third."""
    smooth, noisy = balls([0.05]), balls([0.05], noise=0.005)
    assert radius_of_gyration(smooth) == pytest.approx([0.05], rel=0.02)
    assert radius_of_gyration(noisy) == pytest.approx([0.05], rel=0.05)
    assert noisy.geometry[1].sum() > 1.3 * smooth.geometry[1].sum()
