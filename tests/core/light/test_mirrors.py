"""Light over flat mirrors against the same light from the mirror image, set up as geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light.emitters import bright_triangles
from addon.core.light.irradiance import direct, gather
from addon.core.light.mirrors import Mirror, in_their_planes, reflect
from addon.core.light.over_mirrors import direct_over_mirrors
from addon.core.passes.mirrors.flat_mirrors import plane_of
from tests.core.rooms import box_sides, make_room, polygon_irradiance, quad, split

F0 = np.float32([0.9, 0.8, 0.7])
LAMP = np.float32([10, 20, 30])
GLASS = Mirror(2, np.float32([0, 0, 1]), np.float32([1, 0, 0]), F0)
"""The plane x = 0, seen from x > 0."""


def lamp_at(x: float):
    """A lamp 0.4 m square that faces a wall's mirror from x: its normal is -X for x > 0, +X for its image."""
    side = 0.4
    edges = ((0, 0, side), (0, side, 0)) if x > 0 else ((0, side, 0), (0, 0, side))
    return quad((x, -side / 2, 1.0), *edges, 1)


@pytest.fixture(scope="module")
def corner():
    """A floor, a lamp above it that shines away from most of it, and a mirror that it shines at."""
    floor = quad((0.01, -3, 0), (6, 0, 0), (0, 6, 0), 0)
    glass = quad((0, -3, 0.02), (0, 6, 0), (0, 0, 4), 2)
    room = make_room([floor, lamp_at(2.0), glass], 0.2)
    field = room.field(room.by_object({1: LAMP}))
    return room, field.with_light(field.radiance, lamps=[1])


def places(count=60):
    """Spots on the floor behind the lamp, which only the mirror lights."""
    rng = np.random.default_rng(0)
    position = np.stack([rng.uniform(2.5, 4, count), rng.uniform(-1, 1, count), np.zeros(count)], -1)
    return position.astype(np.float32), np.tile(np.float32([0, 0, 1]), (count, 1))


def test_reflect_keeps_length_and_turns_the_normal():
    normal = np.float32([0.6, 0.8, 0])
    vectors = np.random.default_rng(0).normal(size=(20, 3)).astype(np.float32)
    turned = reflect(vectors, normal)
    assert np.allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(vectors, axis=1), rtol=1e-5)
    assert np.allclose(turned @ normal, -vectors @ normal, atol=1e-5)


def test_a_lamp_over_a_mirror_is_its_image(corner):
    """The lamp's image stands as far behind the glass as the lamp before it, dimmed by f0: the polygon's formula."""
    _, field = corner
    position, normal = places()
    field = field.with_mirrors((GLASS,))
    bright = bright_triangles(field)
    E = direct_over_mirrors(field, bright, position, normal, 256, 0)
    truth = polygon_irradiance(position.astype(float), normal.astype(float), [lamp_at(-2.0)])
    assert (truth > 0).all()
    assert np.allclose(E, truth[:, :1] * LAMP * F0, rtol=0.05)
    assert E.mean() == pytest.approx((truth[:, :1] * LAMP * F0).mean(), rel=0.01)


@pytest.mark.parametrize("shift, tilt", [(0.004, 0.0), (-0.004, 0.0), (0.0, 0.003), (0.0, -0.003)])
def test_a_plane_that_is_a_little_off_the_mesh_casts_no_shadow(corner, shift, tilt):
    """The image is then off by millimetres, and so is the light; the lamp must not hide itself."""
    _, field = corner
    position, normal = places()
    tilted = np.float32([np.cos(tilt), 0, np.sin(tilt)])
    glass = Mirror(2, np.float32([shift, 0, 1]), tilted, F0)
    field = field.with_mirrors((glass,))
    E = direct_over_mirrors(field, bright_triangles(field), position, normal, 256, 0)
    truth = polygon_irradiance(position.astype(float), normal.astype(float), [lamp_at(-2.0)])
    assert E.mean() == pytest.approx((truth[:, :1] * LAMP * F0).mean(), rel=0.02)


def test_without_the_mirror_nothing_comes(corner):
    _, field = corner
    position, normal = places()
    bright = bright_triangles(field)
    assert not direct(field, bright, position, normal, 16, 64, 0)[0].any()  # the lamp's back is dark
    assert not direct_over_mirrors(field, bright, position, normal, 64, 0).any()


def test_gather_counts_light_over_a_mirror_once(corner):
    """Aimed through the mirror, or met by chance: the same light."""
    room, field = corner
    position, normal = places(12)
    field = field.with_mirrors((GLASS,))
    bright = bright_triangles(field)
    aimed, _, _ = gather(field, bright, position, normal, 256, 256, 0)
    by_chance, _, _ = gather(field, bright, position, normal, 1 << 16, 0, 0)
    assert aimed.mean() == pytest.approx(by_chance.mean(), rel=0.03)


def test_something_before_the_mirror_hides_the_lamp():
    floor = quad((0.01, -3, 0), (6, 0, 0), (0, 6, 0), 0)
    glass = quad((0, -3, 0.02), (0, 6, 0), (0, 0, 4), 2)
    board = quad((0.5, -3, 0.02), (0, 6, 0), (0, 0, 4), 3)
    room = make_room([floor, lamp_at(2.0), glass, board], 0.2)
    field = room.field(room.by_object({1: LAMP})).with_mirrors((GLASS,))
    position, normal = places(12)
    assert not direct_over_mirrors(field, bright_triangles(field), position, normal, 64, 0).any()


def test_a_perfect_mirror_in_a_furnace_changes_nothing():
    room = make_room(box_sides(), 0.25)
    field = room.field(room.by_object({}, default=1.0))
    wall = int(room.atlas.object_id[0])
    own = room.atlas.object_id == wall
    glass = Mirror(wall, room.atlas.position[own][0], room.atlas.normal[own][0], np.ones(3, np.float32))
    position, normal = room.atlas.position[~own][::7], room.atlas.normal[~own][::7]
    E, _, _ = gather(field.with_mirrors((glass,)), bright_triangles(field), position, normal, 64, 0, 0)
    assert np.allclose(E, np.pi, rtol=1e-4)


def test_a_plane_is_found_and_a_box_is_not(corner):
    _, field = corner
    point, normal = plane_of(field, 2)
    assert abs(normal[0]) == pytest.approx(1) and point[0] == pytest.approx(0, abs=1e-6)
    room = make_room([*box_sides(first_id=0)], 0.25)
    together = room.mesh.object_id * 0
    one = replace(room.atlas, object_id=room.atlas.object_id * 0)
    whole = room.field(room.by_object({}, default=1.0))
    whole.atlas, whole.mesh = one, replace(room.mesh, object_id=together)
    assert plane_of(whole, 0) is None
    assert plane_of(whole, 99) is None


def test_a_noisy_mirror_is_written_in_the_plane_that_it_shows():
    """A pane of many triangles with a bevel, off by a degree and by noise."""
    glass, bevel = quad((0, 2, 0), (1, 0, 0), (0, 0, 1), 3), quad((0, 2, 1), (1, 0, 0), (0, 0.02, 0.02), 3)
    pane = make_room([*split(glass, 4), bevel, quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 4)], 0.1).mesh
    vertices = pane.vertices.copy()
    front = np.arange(len(vertices)) < 4 * 16
    vertices[front, 1] += np.tan(np.radians(1)) * (vertices[front, 0] - 0.5)
    mesh = replace(pane, vertices=vertices)
    mirror = Mirror(3, np.float32([9, 9, 9]), np.float32([0, -1, 0]), np.ones(3, np.float32))
    found = in_their_planes(mesh, (mirror,))
    assert np.abs(found[front, 1] - 2).max() < 1e-3
    assert np.array_equal(found[~front], vertices[~front])
    assert np.array_equal(in_their_planes(mesh, ()), vertices)
    backs = replace(mesh, backs=np.array([0], np.int32))
    assert np.array_equal(in_their_planes(backs, (mirror,)), vertices)
