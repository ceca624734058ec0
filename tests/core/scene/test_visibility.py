"""What a frame sees of the elements: projection, occlusion, and how far each observation can be trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.scene.element_groups import ElementGroups
from addon.core.scene.visibility import CLEAN, EDGE, SATURATED, normal_variance, observe, view_frame
from tests.core.rooms import all_round, around, box_sides, look_at, make_room, pixels_of, quad

WALL = quad((3, 2, -2), (0, -4, 0), (0, 0, 4), 0)  # at x = 3, seen from the origin
BOARD = quad((2, 0.5, -0.5), (0, -1, 0), (0, 0, 1), 1)  # before its middle
CAMERA = look_at((0, 0, 0), (1, 0, 0), 60, 40, 60)


def sees(room, camera, pixels=None, elements=None):
    view = view_frame(camera, room.mesh, room.scene)
    if pixels is None:
        pixels = pixels_of(np.ones((camera.height, camera.width, 3)))
    return view, observe(view, pixels, room.atlas, room.scene, elements)


@pytest.fixture(scope="module")
def wall():
    return make_room([WALL], 0.1)


@pytest.fixture(scope="module")
def board():
    return make_room([WALL, BOARD], 0.1)


def test_project_and_directions_agree():
    for camera in (CAMERA, look_at((1, 2, 3), (-4, 0, 1)), look_at((0, 0, 0), (0, 0, -1))):
        pixels = np.random.default_rng(0).uniform(0, 40, (50, 2))
        points = camera.centre + np.linspace(0.5, 9, 50)[:, None] * camera.directions(pixels)
        back, depth = camera.project(points)
        assert np.allclose(back, pixels, atol=1e-4) and (depth > 0).all()
    assert camera.project(np.array([[0.0, 0, 1]]))[1][0] < 0


def test_pixel_0_0_is_at_the_upper_left():
    up_left = CAMERA.directions(np.array([[0.5, 0.5]]))[0]  # looks along +x, so left is +y
    assert up_left[1] > 0 and up_left[2] > 0


def test_a_wall_seen_straight_on(wall):
    """Element at (3, y, z): the picture holds its y in red and its z in green, so the bilinear value is its place."""
    directions = CAMERA.directions(CAMERA.pixel_centres())
    place = directions / directions[:, :1] * 3
    image = np.concatenate([place[:, 1:] + 10, np.ones((len(place), 1))], 1).reshape(40, 60, 3)
    view, seen = sees(wall, CAMERA, pixels_of(image))
    assert np.array_equal(view.triangle >= 0, view.object_id == 0)
    assert np.allclose(view.distance.ravel(), np.linalg.norm(place, axis=1), rtol=1e-5)
    position = wall.atlas.position[seen.element]
    assert (np.diff(seen.element) > 0).all()
    inner = (np.abs(position[:, 1]) < 1.6) & (np.abs(position[:, 2]) < 1.0)
    assert (seen.tier[inner] == CLEAN).all()
    assert np.allclose(seen.radiance[inner, :2] - 10, position[inner, 1:], atol=2e-3)
    assert np.allclose(seen.direction, -position / np.linalg.norm(position, axis=1)[:, None], atol=1e-5)
    # all that lies inside the frame, and no more
    xy, _ = CAMERA.project(wall.atlas.position)
    inside = ((xy >= 0.5) & (xy < [59.5, 39.5])).all(1)
    assert np.array_equal(seen.element, np.flatnonzero(inside))


def test_backs_and_what_is_behind_are_not_seen(wall):
    behind = look_at((6, 0, 0), (3, 0, 0))
    assert len(sees(wall, behind)[1].element) == 0
    away = look_at((0, 0, 0), (-1, 0, 0))
    assert len(sees(wall, away)[1].element) == 0


def test_an_occluder_hides(board):
    _, seen = sees(board, CAMERA)
    y, z = np.abs(board.atlas.position[:, 1:]).T
    on_wall = board.atlas.object_id == 0
    observed = np.isin(np.arange(len(board.atlas)), seen.element)
    shadow = np.maximum(y, z) < 0.75  # the board's half edge times 3 / 2
    assert not observed[on_wall & shadow].any()
    assert observed[on_wall & ~shadow & (y < 1.6) & (z < 1.05) & (np.maximum(y, z) > 0.85)].all()
    assert observed[~on_wall].all()


def test_a_thin_occluder_between_pixel_and_element_hides():
    """Embree decides for each element: a bar thinner than a pixel is in no pixel's centre."""
    bar = quad((1, 0.05, -3), (0, -0.02, 0), (0, 0, 6), 1)
    room = make_room([WALL, bar], 0.02)
    camera = look_at((0, 0, 0), (1, 0, 0), 20, 14, 60)
    view, seen = sees(room, camera)
    assert (view.object_id == 0).all()
    y = room.atlas.position[seen.element, 1]
    assert not ((y > 0.095) & (y < 0.145)).any() and ((y > 0.16) & (y < 0.3)).any()


def test_pixels_of_another_object_are_rejected(board):
    """A board beside the wall's own place: wherever the pixel shows it, the wall takes nothing."""
    image = np.ones((40, 60, 3))
    view = view_frame(CAMERA, board.mesh, board.scene)
    image[view.object_id == 1] = 100
    _, seen = sees(board, CAMERA, pixels_of(image))
    own = board.atlas.object_id[seen.element] == 0
    assert seen.radiance[own].max() == 1 and seen.radiance[~own].min() == 100


@pytest.mark.parametrize(("height", "visible"), [(0.9, False), (1.15, True)])
def test_grazing_views_are_rejected(height, visible):
    """n.v = height / distance at 5 m: 0.18 and 0.23 either side of the limit 0.2."""
    floor = make_room([quad((4.9, -0.1, 0), (0.2, 0, 0), (0, 0.2, 0), 0)], 0.05)
    _, seen = sees(floor, look_at((0, 0, height), (5, 0, 0), 64, 64, 20))
    assert bool(len(seen.element)) == visible


def test_depth_edges_are_told_from_clean_pixels():
    room = make_room([WALL, BOARD], 0.02)
    _, seen = sees(room, CAMERA)
    position, own = room.atlas.position[seen.element], room.atlas.object_id[seen.element]
    # Pixels that the element lies inside (or outside) the board's border in the picture.
    inside = (0.5 - np.abs(position[:, 1:] / position[:, :1] * 2).max(1)) * CAMERA.fx / 2
    assert (seen.tier[np.abs(inside) < 0.5] == EDGE).all() and (np.abs(inside) < 0.5).sum() > 50
    assert (seen.tier[np.abs(inside) > 2.1] == CLEAN).all()
    assert {0, 1} == set(own[seen.tier == EDGE])


def test_an_edge_within_one_object_counts(board):
    """Same object before itself: only the depth tells."""
    room = make_room([WALL, quad(BOARD.corner, BOARD.edge_u, BOARD.edge_v, 0)], 0.1)
    several, _ = sees(board, CAMERA)
    one, _ = sees(room, CAMERA)
    assert np.array_equal(one.clean, several.clean) and not one.clean.all()


@pytest.mark.parametrize("whole", [False, True])
def test_parts_by_shape_alone_border_within_a_surface(board, whole):
    """Two halves of a wall, and a board before it: where nobody told objects only the board has edges."""
    halves = make_room([quad((3, 2, -2), (0, -2, 0), (0, 0, 4), 0), quad((3, 0, -2), (0, -2, 0), (0, 0, 4), 2)], 0.1)
    room = replace(halves, mesh=replace(halves.mesh, whole=whole))
    _, seen = sees(room, CAMERA)
    beside = np.abs(room.atlas.position[seen.element, 1]) < 0.1
    assert len(np.unique(seen.element)) == len(seen.element) and beside.any()
    assert (seen.tier[beside] == CLEAN).all() == whole
    before = replace(board, mesh=replace(board.mesh, whole=whole))
    told, same = sees(board, CAMERA)[1], sees(before, CAMERA)[1]
    assert np.array_equal(told.element, same.element) and np.array_equal(told.tier, same.tier)


def test_a_slanted_plane_has_no_edges():
    floor = make_room([quad((1, -5, -1), (10, 0, 0), (0, 10, 0), 0)], 0.5)
    view, _ = sees(floor, look_at((0, 0, 0), (4, 0, -1), 40, 40, 30))
    assert (view.object_id == 0).any()
    inside = view.object_id == 0
    for shift in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
        inside &= np.roll(view.object_id, shift, (0, 1)) == 0
    assert view.clean[1:-1, 1:-1][inside[1:-1, 1:-1]].all()


def test_saturated_and_invalid_pixels(wall):
    image = np.ones((40, 60, 3))
    saturated, valid = np.zeros((40, 60), bool), np.ones((40, 60), bool)
    saturated[10, 15], valid[30, 45] = True, False
    image[10, 15], image[30, 45] = 50, 0
    _, seen = sees(wall, CAMERA, pixels_of(image, valid, saturated))
    xy, _ = CAMERA.project(wall.atlas.position[seen.element])
    column, row = np.floor(xy).astype(int).T
    clipped = (row == 10) & (column == 15)
    assert clipped.any() and (seen.tier[clipped] == SATURATED).all() and (seen.radiance[clipped] == 50).all()
    assert not ((row == 30) & (column == 45)).any()
    # The neighbours of both are usable, but without a bilinear sample that would reach into them.
    for y, x in ((10, 15), (30, 45)):
        beside = (np.abs(row - y) <= 1) & (np.abs(column - x) <= 1) & ~clipped
        assert (seen.tier[beside] == EDGE).all()
    assert (seen.radiance[~clipped] == 1).all()


def test_asking_for_some_elements_gives_the_same(board):
    _, every = sees(board, CAMERA)
    some = np.arange(0, len(board.atlas), 3)
    _, part = sees(board, CAMERA, elements=some)
    wanted = np.isin(every.element, some)
    assert np.array_equal(part.element, every.element[wanted])
    assert np.array_equal(part.tier, every.tier[wanted]) and np.array_equal(part.radiance, every.radiance[wanted])


@pytest.mark.parametrize("seed", range(3))
def test_groups_leave_out_only_what_is_not_seen(seed):
    """Random clutter, random cameras: with and without groups the same observations."""
    rng = np.random.default_rng(seed)
    quads = box_sides()
    for i in range(25):
        u, v = rng.normal(0, 0.3, (2, 3))
        quads.append(quad(rng.uniform(0.3, 1.8, 3), u, v - u * (u @ v) / (u @ u), 6 + i % 7))
    room = make_room(quads, 0.04)
    groups = ElementGroups(room.atlas)
    left_out = 0
    closer = [look_at(rng.uniform(0.2, 2.4, 3), (2, 1.4, 1), 40, 30, 50) for _ in range(2)]
    for camera in all_round((2, 1.5, 1.2), 32) + closer:
        view, every = sees(room, camera)
        candidates = groups.candidates(view)
        _, part = sees(room, camera, elements=candidates)
        assert (np.diff(candidates) > 0).all()
        assert np.array_equal(part.element, every.element) and np.array_equal(part.radiance, every.radiance)
        left_out += len(room.atlas) - len(candidates)
    assert left_out > 4 * len(room.atlas)  # of eight frames at most half is looked at


def test_groups_know_that_surfaces_curve():
    """A pillar of 48 strips: within one group normals spread, and at its rim some strips of a group are seen."""
    at = np.linspace(0, 2 * np.pi, 49)
    ring = 0.3 * np.stack([np.cos(at), np.sin(at)], 1)
    strips = [quad((*a, -0.5), (*(b - a), 0), (0, 0, 1), 0) for a, b in zip(ring[:-1], ring[1:])]
    room = make_room(strips, 0.02)
    groups = ElementGroups(room.atlas)
    for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        camera = look_at((2 * np.cos(angle), 2 * np.sin(angle), 0.1), (0, 0, 0), 64, 64, 40)
        view, every = sees(room, camera)
        candidates = groups.candidates(view)
        assert len(every.element) > 200 and np.isin(every.element, candidates).all()
        assert len(candidates) < 0.9 * len(room.atlas)


def test_how_a_surface_turns_within_a_pixel(wall):
    """A pillar's normal turns by the pixel's width over its radius; half of that on either side of the middle."""
    at = np.linspace(0, 2 * np.pi, 721)
    ring = 0.3 * np.stack([np.cos(at), np.sin(at)], 1)
    pillar = make_room([quad((*a, -0.5), (*(b - a), 0), (0, 0, 1), 0) for a, b in zip(ring[:-1], ring[1:])], 0.02)
    camera = look_at((2, 0, 0), (0, 0, 0), 64, 64, 40)
    view, seen = sees(pillar, camera)
    before = seen.element[pillar.atlas.normal[seen.element, 0] > 0.98]
    found = normal_variance(view, pillar.atlas, before, pillar.normals)
    half = camera.pixel_angle * 1.7 / 0.3 / 2
    assert len(before) > 50 and np.median(found) == pytest.approx(half**2, rel=0.2)
    view, seen = sees(wall, CAMERA)
    assert normal_variance(view, wall.atlas, seen.element, wall.normals).max() < 1e-6


def test_escaped_pixels_are_clean_where_all_around_escapes():
    room = make_room(around(WALL, (0.4, 0.6), (0.4, 0.6)), 0.1)  # a hole of 0.8 m
    view, _ = sees(room, CAMERA)
    hole = view.triangle < 0
    assert hole.any() and (view.object_id[hole] == -1).all()
    assert view.clean[20, 30] and not view.clean[hole].all()
