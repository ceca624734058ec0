"""Flat mirrors are told by the room that they show, from frames summed up without the code under test."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from addon.core.light.lamps import Lamp
from addon.core.passes.mirrors.flat_mirrors import find_mirrors
from addon.core.scene.model import Instance
from addon.core.scene.samples import Samples
from tests.core.glossy_box import Box

SILVER = np.array([0.9, 0.85, 0.8])
FLOOR = (Instance(0, "floor"),)


@pytest.fixture(scope="module")
def box():
    return Box()


def frames(box, f0, diffuse=0.0, noise=0.1, tilt=0.0, seed=0):
    """The floor's samples: the mirrored room times f0 over a diffuse part; the floor truly faces `tilt` off +Z."""
    element, direction, frame = box.views(120, 10)
    normal = np.array([np.sin(tilt), 0, np.cos(tilt)])
    w = direction.astype(float)
    along = 2 * (w @ normal)[:, None] * normal - w
    origin = box.room.atlas.position[element].astype(float) + [0, 0, 1e-6]
    seen = f0 * box.arriving(origin, along) + diffuse
    seen = seen * np.exp(np.random.default_rng(seed).normal(0, noise, seen.shape))
    return Samples(
        element.astype(np.int32),
        frame.astype(np.int32),
        np.float32(seen),
        direction,
        np.zeros(len(element), bool),
        np.zeros(len(element), np.float32),
    )


def test_a_mirror(box):
    (mirror,) = find_mirrors(box.field, (), frames(box, SILVER), FLOOR)
    assert mirror.object_id == 0 and abs(mirror.point[2]) < 1e-5
    np.testing.assert_allclose(mirror.f0, SILVER, rtol=0.05)
    assert np.degrees(np.arccos(min(mirror.normal[2], 1))) < 0.2


def test_a_mirror_of_which_most_is_seen_once(box):
    """What was seen once has no deviation from its own mean, and is no sign against a mirror."""
    samples = frames(box, SILVER)
    again = np.arange(len(samples.element)) % 10
    kept = (again == 0) | ((again < 3) & (np.arange(len(again)) // 10 % 5 == 0))
    count = np.bincount(samples.element[kept])
    assert (count == 1).sum() > count[count > 1].sum()
    (mirror,) = find_mirrors(box.field, (), Samples(*(getattr(samples, f.name)[kept] for f in fields(Samples))), FLOOR)
    np.testing.assert_allclose(mirror.f0, SILVER, rtol=0.1)


def test_the_plane_of_a_scan_is_put_right(box):
    """The mesh is off by half a degree: what is mirrored says how the mirror hangs."""
    (mirror,) = find_mirrors(box.field, (), frames(box, SILVER, tilt=np.radians(0.5)), FLOOR)
    assert np.degrees(np.arcsin(mirror.normal[0])) == pytest.approx(0.5, abs=0.2)
    assert abs(np.degrees(np.arcsin(mirror.normal[1]))) < 0.2


@pytest.mark.parametrize(
    ("f0", "diffuse"),
    [(0.0, 0.5), (0.04, 0.3), (0.06, 0.0), (5.0, 0.0)],  # diffuse; lacquer; a black pane; more than it gets
)
def test_what_is_no_mirror(box, f0, diffuse):
    assert find_mirrors(box.field, (), frames(box, f0, diffuse), FLOOR) == ()


def test_too_little_to_tell(box):
    samples = frames(box, SILVER)
    few = Samples(*(getattr(samples, one.name)[:90] for one in fields(Samples)))
    assert find_mirrors(box.field, (), few, FLOOR) == ()
    assert find_mirrors(box.field, (), replace(samples, saturated=np.ones(len(samples.element), bool)), FLOOR) == ()


def test_a_lamp_is_no_mirror(box):
    assert find_mirrors(box.field, (Lamp(0, np.ones(3), True),), frames(box, SILVER), FLOOR) == ()
