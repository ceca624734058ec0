"""A bevel that the mesh does not have is found by what it shows."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.mirrors import Mirror
from addon.core.passes.mirrors.facets import facets_of
from addon.core.scene.samples import Samples
from tests.core.glossy_box import Box

F0 = np.float32([0.9, 0.85, 0.8])
FLOOR = Mirror(0, np.float32([0, 0, 0]), np.float32([0, 0, 1]), F0)


@pytest.fixture(scope="module")
def box():
    return Box()


def frames(box, tilt, noise=0.1, views=10):
    """What the floor shows as a mirror, one of its triangles truly facing `tilt` ((2,)) off +Z."""
    element, direction, frame = box.views(200, views)
    bevel = int(box.room.atlas.triangle[element].max())
    normal = np.zeros((len(element), 3)) + [0, 0, 1]
    there = box.room.atlas.triangle[element] == bevel
    normal[there] = np.array([*tilt, 1]) / np.linalg.norm([*tilt, 1])
    w = direction.astype(float)
    along = 2 * (w * normal).sum(1, keepdims=True) * normal - w
    origin = box.room.atlas.position[element].astype(float) + [0, 0, 1e-6]
    seen = F0 * box.arriving(origin, along)
    seen = seen * np.exp(np.random.default_rng(0).normal(0, noise, seen.shape))
    order = np.lexsort((frame, element))
    samples = Samples(element.astype(np.int32), frame.astype(np.int32), np.float32(seen), direction,
                      np.zeros(len(element), bool))  # fmt: skip
    return bevel, Samples(*(getattr(samples, name)[order] for name in Samples.__dataclass_fields__))


@pytest.mark.parametrize("tilt", [(0.1, 0.0), (0.0, -0.08), (0.07, 0.05)])
def test_a_bevel(box, tilt):
    bevel, samples = frames(box, tilt)
    triangle, normal = facets_of(box.field, samples, FLOOR)
    assert triangle.tolist() == [bevel]
    assert normal[0, :2] / normal[0, 2] == pytest.approx(tilt, abs=0.005)
    assert np.linalg.norm(normal[0]) == pytest.approx(1, abs=1e-5)


def test_a_plane_has_none(box):
    triangle, normal = facets_of(box.field, frames(box, (0, 0))[1], FLOOR)
    assert triangle.shape == (0,) and normal.shape == (0, 3)


def test_too_little_to_tell(box):
    """Nine observations a triangle."""
    _, samples = frames(box, (0.1, 0))
    few = np.arange(0, len(samples.element), 110)
    few = Samples(*(getattr(samples, name)[few] for name in Samples.__dataclass_fields__))
    assert facets_of(box.field, few, FLOOR)[0].shape == (0,)
