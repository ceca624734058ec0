"""A mirror that is of one part with its wall is set apart, from frames summed up without the code under test."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from addon.core.passes.mirrors.flat_mirrors import find_mirrors
from addon.core.passes.mirrors.mirror_patches import mirror_patches
from addon.core.scene.model import Capture
from addon.core.scene.patches import Patches
from addon.core.scene.samples import Samples
from tests.core.glossy_box import SIZE, Box
from tests.core.rooms import around, cut, lit_box, make_room

LOW, HIGH, ABOVE = np.array([1.0, 0.6]), np.array([3.0, 2.4]), 0.02
"""Of the mirror on the floor, metres."""


def with_mirror(above: float) -> Box:
    """A floor with a board of the same object on it, or in it."""
    box = Box()
    floor, *others = lit_box(tuple(SIZE))
    u, v = ((float(LOW[i] / SIZE[i]), float(HIGH[i] / SIZE[i])) for i in (0, 1))
    board = cut(floor, u, v)
    board = replace(board, corner=board.corner + [0, 0, above])
    box.room = make_room([*around(floor, u, v), board, *others], 0.1)
    return box


@pytest.fixture(scope="module")
def box():
    return with_mirror(ABOVE)


def in_ellipse(points: np.ndarray) -> np.ndarray:
    """Whether points of the floor ((n, 2)) lie in the ellipse that touches the mirror's edges."""
    return (((points - (LOW + HIGH) / 2) / (HIGH - LOW) * 2) ** 2).sum(1) < 1


def frames(box, f0, diffuse=0.3, noise=0.05, below=0.0, round_mirror=False):
    """The floor's samples: diffuse, with a mirror in its middle, `below` which as much is scattered."""
    element, direction, frame = box.views(900, 10)
    origin = box.room.atlas.position[element].astype(float) + [0, 0, 1e-6]
    inside = ((origin[:, :2] > LOW) & (origin[:, :2] < HIGH)).all(1)
    inside &= in_ellipse(origin[:, :2]) | (not round_mirror)
    shown = box.arriving(origin, np.array([-1, -1, 1]) * direction)
    seen = np.where(inside[:, None], below + f0 * shown, diffuse)
    seen = seen * np.exp(np.random.default_rng(0).normal(0, noise, seen.shape))
    return Samples(
        element.astype(np.int32),
        frame.astype(np.int32),
        np.float32(seen),
        direction,
        np.zeros(len(element), bool),
        np.zeros(len(element), np.float32),
    )


def test_a_mirror_on_a_floor(box):
    samples = frames(box, 0.85)
    patches = mirror_patches(box.field, samples)
    assert len(patches.mirrors) == 1 and patches.objects == patches.mirrors.tolist() and not patches.lamps
    mesh = box.room.mesh
    raised = (mesh.object_id == 0) & (mesh.vertices[mesh.triangles][:, :, 2] > ABOVE / 2).all(1)
    assert np.array_equal(patches.triangle, np.flatnonzero(raised))

    capture = patches.capture(Capture(None, mesh, box.room.instances, ()))
    assert [one.class_name for one in capture.instances if one.object_id in patches.mirrors] == ["mirror"]
    set_apart = replace(box.room, mesh=capture.mesh)
    field = set_apart.field(box.field.radiance)
    (mirror,) = find_mirrors(field, (), samples, capture.instances)
    assert mirror.object_id == patches.mirrors[0]
    np.testing.assert_allclose(mirror.f0, 0.85, rtol=0.1)


def test_a_mirror_on_a_part_that_is_a_floor_and_a_wall():
    box = with_mirror(ABOVE)
    radiance = box.field.radiance  # the wall's own, as before
    box.room = make_room([replace(quad, object_id=quad.object_id % 5) for quad in box.room.quads], 0.1)
    assert len(mirror_patches(box.room.field(radiance), frames(box, 0.85)).mirrors) == 1


@pytest.mark.parametrize(("f0", "diffuse"), [(0.0, 0.3), (0.06, 0.05)])  # no mirror at all; a black pane
def test_what_is_no_mirror(box, f0, diffuse):
    assert not len(mirror_patches(box.field, frames(box, f0, diffuse)))


def test_a_mirror_in_the_plane_of_its_floor():
    """A fused mesh has no step at its rim."""
    box = with_mirror(0.0)
    patches = mirror_patches(box.field, frames(box, 0.85))
    assert len(patches.mirrors) == 1
    corners = box.room.mesh.vertices[box.room.mesh.triangles[patches.triangle]][..., :2]
    assert (corners > LOW - 1e-4).all() and (corners < HIGH + 1e-4).all()
    assert len(corners) == 2


@pytest.fixture(scope="module")
def tiled():
    """A floor of one part and of many triangles."""
    box = Box()
    floor, *others = lit_box(tuple(SIZE))
    tiles = [cut(floor, (i / 40, (i + 1) / 40), (j / 30, (j + 1) / 30)) for i in range(40) for j in range(30)]
    box.room = make_room([*tiles, *others], 0.05)
    return box


def area_of(box, patches) -> float:
    return float(box.room.mesh.geometry[1][patches.triangle].sum())


def test_corners_that_no_view_shows(tiled):
    """A mirror is taken for a rectangle where nothing tells otherwise."""
    samples = frames(tiled, 0.85)
    place = tiled.room.atlas.position[samples.element][:, :2]
    in_corner = ((place > LOW) & (place < HIGH)).all(1) & ~in_ellipse(place)
    samples = Samples(*(getattr(samples, field.name)[~in_corner] for field in fields(Samples)))
    patches = mirror_patches(tiled.field, samples)
    assert len(patches.mirrors) == 1
    assert area_of(tiled, patches) == pytest.approx(np.prod(HIGH - LOW), rel=0.1)


def test_a_round_mirror(tiled):
    patches = mirror_patches(tiled.field, frames(tiled, 0.85, diffuse=0.05, round_mirror=True))
    assert len(patches.mirrors) == 1
    ellipse = np.pi / 4 * np.prod(HIGH - LOW)
    assert 0.65 * ellipse < area_of(tiled, patches) < 1.05 * ellipse


@pytest.mark.parametrize("f0", [0.06, 0.2])
def test_a_polished_floor_that_mirrors_in_one_place(f0):
    box = with_mirror(0.0)
    assert not len(mirror_patches(box.field, frames(box, f0, below=0.3)))


def test_too_little_to_tell(box):
    samples = frames(box, 0.85)
    assert not len(mirror_patches(box.field, replace(samples, saturated=np.ones(len(samples.element), bool))))


def test_patches_together_and_kept():
    lamps = Patches(np.array([3, 4], np.int32), np.array([7, 7], np.int32))
    mirrors = Patches(np.array([1, 9], np.int32), np.array([8, 9], np.int32), np.array([8, 9], np.int32))
    both = Patches.together([lamps, mirrors])
    assert both.objects == [7, 8, 9] and both.lamps == [7]
    kept, number = both.grouped([[9]])
    assert number == {9: 7} and kept.mirrors.tolist() == [7] and kept.triangle.tolist() == [9]
