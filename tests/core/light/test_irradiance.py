"""Irradiance against furnaces and form factors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light import emitters
from addon.core.light.emitters import bright_triangles
from addon.core.light.environment import Environment
from addon.core.light.few_elements import irradiance_at
from addon.core.light.irradiance import direct, gather
from addon.core.light.params import GATHER
from tests.core.rooms import box_sides, lit_box, make_room, polygon_irradiance, quad

LAMP_SIDE, HEIGHT = 0.4, 2.0


def corner_factor(a: float, b: float) -> float:
    """Form factor of a small plane to a parallel rectangle a * b over it, at its corner; lengths over the distance."""
    first, second = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
    return (a / first * np.arctan(b / first) + b / second * np.arctan(a / second)) / (2 * np.pi)


@pytest.fixture(scope="module")
def furnace():
    room = make_room(box_sides(), 0.25)
    return room, room.field(room.by_object({}, default=(1, 2, 3)))


@pytest.fixture(scope="module")
def lamp():
    """A square lamp over an endless floor that reflects nothing."""
    half = LAMP_SIDE / 2
    shade = quad((-half, -half, HEIGHT), (0, LAMP_SIDE, 0), (LAMP_SIDE, 0, 0), 1)
    room = make_room([quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), 0), shade], 0.2)
    return room, room.field(room.by_object({1: (10, 20, 30)})), shade


def both(field, bright, normals, position, normal, rays, emitter_rays, seed=0):
    around, _, _ = gather(field, bright, position, normal, rays, emitter_rays, seed)
    return around + direct(field, bright, position, normal, rays, emitter_rays, seed + 1)[0]


def test_polygon_formula_is_the_form_factor():
    over = quad((0, 0, 1), (0, 0.7, 0), (0.4, 0, 0), 0)
    E = polygon_irradiance(np.zeros((1, 3)), np.float64([[0, 0, 1]]), [over])
    assert E[0, 0] == pytest.approx(np.pi * corner_factor(0.7, 0.4), rel=1e-9)


def test_a_furnace_gives_pi_l(furnace):
    room, field = furnace
    bright = bright_triangles(field)
    assert len(bright) == 0  # nothing stands out
    E, radius, escaped = gather(field, bright, room.atlas.position, room.atlas.normal, 16, 0, 0)
    assert np.allclose(E, np.pi * np.float32([1, 2, 3]), rtol=1e-4)  # each cosine ray brings the same
    assert not escaped.any() and (radius > 0).all() and (radius < 5.6).all()


@pytest.mark.parametrize("aimed_at", [{0}, {2, 3}, {1, 4}])
def test_a_furnace_with_rays_aimed_at_some_of_its_walls(furnace, aimed_at, monkeypatch):
    """The walls aimed at are as bright as the rest: the weights alone must make the two parts one whole."""
    monkeypatch.setattr(emitters, "GATHER", replace(GATHER, bright=1))
    room, field = furnace
    bright = bright_triangles(room.field(room.by_object({i: 1000 for i in aimed_at}, default=1e-3)))
    assert len(bright) == 2 * len(aimed_at)
    position, normal = room.atlas.position, room.atlas.normal
    inner = np.arange(0, len(room.atlas), 3)
    E = both(field, bright, room.normals, position[inner], normal[inner], 64, 64)
    assert np.allclose(E.mean(0), np.pi * np.float32([1, 2, 3]), rtol=5e-3)


@pytest.mark.parametrize("where", [(0, 0, 0), (0.2, 0.2, 0), (1.0, 0.5, 0), (3, -2, 0)])
def test_a_small_lamp_over_a_plane(lamp, where):
    room, field, shade = lamp
    position, up = np.repeat(np.float32([where]), 64, 0), np.repeat(np.float32([[0, 0, 1]]), 64, 0)
    wanted = polygon_irradiance(position[:1].astype(float), up[:1].astype(float), [shade])[0, 0]
    if where == (0, 0, 0):
        assert wanted == pytest.approx(4 * np.pi * corner_factor(0.1, 0.1), rel=1e-6)
    E = both(field, bright_triangles(field), room.normals, position, up, 16, 64)
    assert np.allclose(E.mean(0), wanted * np.float32([10, 20, 30]), rtol=0.01)
    assert (E.std(0) / E.mean(0)).max() < 0.1


def test_rays_that_are_not_aimed_find_the_same(lamp):
    room, field, shade = lamp
    position, up = np.repeat(np.float32([[0.3, 0, 0]]), 64, 0), np.repeat(np.float32([[0, 0, 1]]), 64, 0)
    wanted = 10 * polygon_irradiance(position[:1].astype(float), up[:1].astype(float), [shade])[0, 0]
    none = bright_triangles(room.field(room.by_object({})))
    around, _, escaped = gather(field, none, position, up, 4096, 0, 0)
    assert around[:, 0].mean() == pytest.approx(wanted, rel=0.03)
    assert escaped.mean() == pytest.approx(1 - wanted / 10 / np.pi, abs=0.003)


@pytest.mark.parametrize(("rays", "emitter_rays"), [(16, 16), (8, 128), (256, 4), (64, 1)])
def test_the_split_between_the_two_parts_changes_nothing(rays, emitter_rays):
    """In a lit box with a bright floor, where both parts matter."""
    room = make_room(lit_box(), 0.2)
    field = room.field(room.by_object({6: 50, 0: 2}, default=0.7))
    point, normal = np.float32([[3.2, 1.2, 1.4]]), np.float32([[-1, 0, 0]])
    many = 65536 // (rays + emitter_rays)
    ways = np.repeat(point, many, 0), np.repeat(normal, many, 0)
    E = both(field, bright_triangles(field), room.normals, *ways, rays, emitter_rays)[:, 0]
    seen = polygon_irradiance(point.astype(float), normal.astype(float), clipped(room.quads, 3.2))[0]
    light = np.array([{6: 50, 0: 2}.get(q.object_id, 0.7) for q in clipped(room.quads, 3.2)])
    assert E.mean() == pytest.approx(seen @ light, rel=0.01)


def clipped(quads, x: float):
    """The parts of axis-parallel quads below a plane of constant x."""
    parts = []
    for q in quads:
        low, high = sorted((q.corner[0], q.corner[0] + q.edge_u[0] + q.edge_v[0]))
        if low >= x - 1e-9:
            continue
        share = min((x - low) / max(high - low, 1e-9), 1)
        along = "edge_u" if abs(q.edge_u[0]) > 0 else "edge_v"
        edge = getattr(q, along)
        corner = q.corner if edge[0] >= 0 else q.corner + (1 - share) * edge
        parts.append(replace(q, corner=corner, **{along: share * edge if high - low > 1e-9 else edge}))
    return parts


def test_a_board_before_the_lamp_takes_its_light(lamp):
    room, _, shade = lamp
    board = quad((-1, -1, 1), (2, 0, 0), (0, 2, 0), 2)
    screened = make_room([*room.quads, board], 0.2)
    field = screened.field(screened.by_object({1: 10}))
    up = np.float32([[0, 0, 1]])
    bright = bright_triangles(field)
    assert not both(field, bright, screened.normals, np.float32([[0, 0, 0]]), up, 64, 64).any()
    assert both(field, bright, screened.normals, np.float32([[0, 0, 1.1]]), up, 64, 64).all()


def test_the_sky_through_an_open_roof():
    """An open floor under a sky of radiance 2 above the horizon."""
    room = make_room([quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), 0)], 0.5)
    sky = np.zeros((16, 32, 3), np.float32)
    sky[8:] = 2
    field = room.field(room.by_object({}), Environment(sky, np.ones((16, 32), np.int32)))
    at, up = np.zeros((1, 3), np.float32), np.float32([[0, 0, 1]])
    E, _, escaped = gather(field, bright_triangles(field), at, up, 64, 0, 0)
    assert np.allclose(E, 2 * np.pi, rtol=1e-5) and escaped[0] == 1


def test_radius_is_the_harmonic_mean_distance():
    """Under an endless ceiling at height h all distances are h / cos: the harmonic mean is h / E[cos] = 1.5 h."""
    room = make_room([quad((-50, -50, 2), (0, 100, 0), (100, 0, 0), 0)], 2)
    field = room.field(room.by_object({}))
    at, up = np.zeros((1, 3), np.float32), np.float32([[0, 0, 1]])
    _, radius, _ = gather(field, bright_triangles(field), at, up, 1024, 0, 0)
    assert radius[0] == pytest.approx(3.0, rel=0.01)


def test_more_rays_at_a_few_elements_leave_less_noise():
    """What an unseen lamp is solved under: noise of the light that is known draws its radiance up."""
    room = make_room([*box_sides(), quad((1, 1, 1.5), (0, 0.5, 0), (0.5, 0, 0), 7)], 0.25)
    rng = np.random.default_rng(0)
    radiance = rng.gamma(0.3, 1.0, (len(room.atlas), 1)).repeat(3, 1).astype(np.float32)
    field, some = room.field(radiance), np.arange(0, len(room.atlas), 29)

    def noise(more: int) -> float:
        return float(np.std([irradiance_at(field, some, seed, more)[:, 0] for seed in range(6)], 0).mean())

    assert noise(4) < 0.7 * noise(1)


def test_a_back_that_rays_meet_is_dark_in_a_mesh_without_objects():
    """A board off a floor that no frame saw from below: a scan lacks its other side, a model may not have one."""
    over = quad((-0.5, -0.5, 0.3), (1, 0, 0), (0, 1, 0), 1)
    room = make_room([quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), 0), over], 0.1)
    floor = np.flatnonzero(room.atlas.object_id == 0)
    position, normal = room.atlas.position[floor], room.atlas.normal[floor]
    factor = polygon_irradiance(position, normal, [replace(over, edge_u=over.edge_v, edge_v=over.edge_u)])[:, 0]
    for scan, sky in ((False, 0), (True, 0), (False, 1), (True, 1)):
        one = replace(room, mesh=replace(room.mesh, whole=scan))
        env = Environment(np.full((8, 16, 3), sky, np.float32), np.ones((8, 16), np.int32))
        field = one.field(one.by_object({1: (2, 2, 2)})).with_light(one.by_object({1: (2, 2, 2)}), env)
        true = sky * (np.pi - factor) + (0 if scan else 2) * factor
        assert np.abs(irradiance_at(field, floor, 0)[:, 0] - true).max() < 0.15 * np.pi
        assert irradiance_at(field, floor, 0)[:, 0].mean() == pytest.approx(true.mean(), rel=0.02, abs=1e-6)
