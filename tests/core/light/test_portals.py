"""Light through openings: aimed rays give what rays by chance give, with less noise."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.emitters import bright_triangles
from addon.core.light.environment import Environment
from addon.core.light.irradiance import from_outside, gather
from addon.core.light.portals import find_portals
from tests.core.rooms import around, box_sides, make_room, polygon_irradiance, quad

WINDOW = ((0.3, 0.6), (0.4, 0.8))


@pytest.fixture(scope="module")
def room():
    """A black box, with a window onto a white sky in the wall at x = 0."""
    sides = box_sides()
    wall = next(s for s in sides if s.corner[0] == 0 and s.edge_u[0] == 0 and s.edge_v[0] == 0)
    made = make_room([s for s in sides if s is not wall] + around(wall, *WINDOW), 0.2)
    sky = Environment(np.ones((8, 16, 3), np.float32), np.ones((8, 16), np.int32))
    field = made.field(made.by_object({}, default=(0, 0, 0)), sky)
    (u, v), corner = WINDOW, wall.corner
    opening = quad(
        corner + u[0] * wall.edge_u + v[0] * wall.edge_v, (u[1] - u[0]) * wall.edge_u, (v[1] - v[0]) * wall.edge_v, 0
    )
    atlas = made.atlas
    inside = np.flatnonzero(atlas.position[:, 0] > 0.5)[::5]
    position, normal = atlas.position[inside], atlas.normal[inside]
    true = polygon_irradiance(position.astype(float), normal.astype(float), [opening])[:, 0]
    return field, position, normal, true


def test_the_opening_is_found(room):
    field, *_ = room
    portals = find_portals(field)
    assert np.isclose(portals.chance.sum(), 1)
    assert set(portals.cell // (portals.density.size // 6)) == {0}  # the low side in x
    # The cells around the window's 1.2 m by 1.0 m hold it all.
    area = portals.size[1] * portals.size[2] / (portals.density.size // 6)
    assert 0.8 < len(portals) * area < 2.3


def test_aimed_and_gathered_add_up(room):
    field, position, normal, true = room
    portals = find_portals(field)
    none = bright_triangles(field)
    E, _, _ = gather(field, none, position, normal, 64, 0, 3, portals, 64)
    lit = true > 0.02
    assert E[lit, 0].mean() == pytest.approx(true[lit].mean(), rel=5e-3)
    by_chance, _, _ = gather(field, none, position, normal, 128, 0, 3)
    error, without = (np.abs(x[lit, 0] / true[lit] - 1).mean() for x in (E, by_chance))
    assert error < 0.06 and error < without / 3


def test_density_is_the_one_that_was_drawn_with(room):
    """What `sample` says of a direction, `aimed_density` says too; and 1 / density averages to the solid angle."""
    field, position, normal, _ = room
    portals = find_portals(field)
    rng = np.random.default_rng(0)
    directions, density = portals.sample(position, rng.random((len(position), 32, 2), np.float32), rng)
    again = portals.aimed_density(np.repeat(position, 32, 0), directions)
    agree = np.isclose(density, again, rtol=1e-3)
    assert agree.mean() > 0.98  # the rest lies on a cell's edge
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-5)


def test_no_light_from_outside_no_portals():
    made = make_room(box_sides(), 0.5)
    assert find_portals(made.field(made.by_object({}, default=(1, 1, 1)))) is None
    sky = Environment(np.ones((2, 4, 3), np.float32), np.ones((2, 4), np.int32))
    assert find_portals(made.field(made.by_object({}, default=(1, 1, 1)), sky)) is None  # closed


def test_from_outside_alone_misses_what_the_heuristic_leaves_to_gather(room):
    field, position, normal, true = room
    part = from_outside(field, find_portals(field), position, normal, 64, 64, 0)[:, 0]
    assert 0.3 < part.sum() / true.sum() < 1


def test_a_ground_around_the_room_moves_no_portal(room):
    """Where the mesh goes on outside, rays are aimed from the room alone, at openings of its own box."""
    _, position, normal, true = room
    sides = box_sides()
    wall = next(s for s in sides if s.corner[0] == 0 and s.edge_u[0] == 0 and s.edge_v[0] == 0)
    ground = quad((-300, -300, -1), (600, 0, 0), (0, 600, 0), 9)
    made = make_room([s for s in sides if s is not wall] + around(wall, *WINDOW), 0.2)
    wide = make_room([*made.quads, ground], 0.2, most={9: 8})
    field = wide.field(wide.by_object({}, default=(0, 0, 0)), room[0].environment)
    portals = find_portals(field)
    assert (portals.size < 12).all() and not portals.around(np.float32([[100, 0, 5]])).any()
    up = normal[:, 2] > 0.5  # the others see the ground, which is dark
    E, _, _ = gather(field, bright_triangles(field), position[up], normal[up], 64, 0, 3, portals, 64)
    lit = true[up] > 0.02
    assert np.abs(E[lit, 0] / true[up][lit] - 1).mean() < 0.1
    out = np.float32([[50, 0, 5]]), np.float32([[0, 0, 1]])
    assert gather(field, bright_triangles(field), *out, 64, 0, 3, portals, 64)[0] == pytest.approx(np.pi, rel=1e-3)
