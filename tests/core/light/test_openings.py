"""Light by the cells of the room's box: what rays find there, and the panels that stand for what is bright."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light.environment import Environment
from addon.core.light.openings import CELLS, Openings, exits, looked_out_by
from tests.core import sunny
from tests.core.rooms import look_at

LOW, SIZE = np.float32([-1, 0, 0.5]), np.float32([4, 3, 2])
USUAL = np.float32([0.2, 0.2, 0.1])


def openings(*bright: int) -> Openings:
    radiance = np.tile(USUAL, (CELLS, 1))
    radiance[list(bright)] = 30, 20, 10
    return Openings(LOW, SIZE, radiance)


def towards(point) -> tuple[np.ndarray, np.ndarray]:
    """A ray from inside of the box to a point on its side."""
    start = LOW + SIZE * np.float32([0.4, 0.6, 0.3])
    way = np.asarray(point, np.float32) - start
    return start[None], (way / np.linalg.norm(way))[None]


@pytest.mark.parametrize("side", range(6))
def test_a_panel_lies_where_rays_meet_its_cells_and_faces_the_room(side):
    first = (side * 24 + 7) * 24 + 11
    found = openings(first, first + 1, (side * 24 + 20) * 24 + 3)
    one, other = sorted(found.panels(), key=lambda panel: -len(panel.corners))
    assert (len(one.corners), len(other.corners)) == (2, 1)
    assert one.radiance == pytest.approx([30, 20, 10])
    for quad in (*one.corners, *other.corners):
        start, way = towards(quad.mean(0))
        assert found(start, way)[0] == pytest.approx(np.float32([[30, 20, 10]]))
        normal = np.cross(quad[1] - quad[0], quad[2] - quad[0])
        assert normal @ way[0] < 0
    assert {int(exits(LOW, SIZE, *towards(quad.mean(0)))[0][0]) for quad in one.corners} == {first, first + 1}


def test_openings_that_are_all_alike_have_no_panel():
    assert not openings().panels() and not openings().bright.any()


def test_a_map_is_filled_where_no_frame_saw_and_without_what_is_written_as_panels():
    observations = np.zeros((64, 128), np.int32)
    observations[:32] = 3
    sky = Environment(np.full((64, 128, 3), 7, np.float32), observations)
    filled = openings(*range(5 * 576, CELLS)).without_bright().filled(sky, LOW + SIZE / 2).radiance
    assert (filled[:32] == 7).all() and (filled[32] > 2.5).all()
    assert filled[-1] == pytest.approx(np.broadcast_to(USUAL, (128, 3)), abs=0.01)


@pytest.mark.parametrize("side", range(6))
def test_a_panel_is_what_closes_the_mesh_before_its_cell(side):
    inward = np.eye(3, dtype=np.float32)[side // 2] * (-1) ** (side % 2)
    bright = openings((side * 24 + 7) * 24 + 11)
    (cell,) = bright.panels()[0].corners
    closing = cell[[[0, 1, 2], [0, 2, 3]]] + 0.1 * inward
    found = bright.panels(closing)
    corners = np.concatenate([panel.corners for panel in found])
    assert np.abs((corners - cell[0]) @ inward - 0.1).max() < 0.01 and ((corners - closing[0, 0]) @ inward > 0).all()
    assert area(corners) == pytest.approx(area(cell[None]), rel=1e-3)
    little = bright.panels(closing[:1, :1] + 0.5 * (closing[:1] - closing[:1, :1]))
    assert sum(area(panel.corners) for panel in little) == pytest.approx(1.125 * area(cell[None]), rel=1e-3)
    elsewhere = bright.panels(closing + 0.5 * np.roll(inward, 1))
    assert len(elsewhere) == 1 and elsewhere[0].corners == pytest.approx(cell[None])


def area(quads: np.ndarray) -> float:
    first, second, third = (quads[:, k] - quads[:, 0] for k in (1, 2, 3))
    return 0.5 * float(np.linalg.norm([np.cross(first, second), np.cross(second, third)], axis=-1).sum())


def test_a_panel_gives_what_the_sky_behind_it_lacks():
    sky = Environment(np.full((8, 16, 3), 4, np.float32), np.zeros((8, 16), np.int32))
    bright = openings(3 * 576 + 30)
    assert bright.panels(sky=sky)[0].radiance == pytest.approx([26, 16, 6])
    assert not bright.panels(sky=Environment(10 * sky.radiance, sky.observations))
    assert not bright.panels(sky=Environment(sky.radiance, sky.observations + 1))


def test_cells_of_which_one_is_far_brighter_are_two_panels():
    first = 4 * 576 + 100
    found = openings(first, first + 1, first + 2)
    found.radiance[first] *= 30
    assert sorted(len(panel.corners) for panel in found.panels()) == [1, 2]


def window_seen(usual: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Which cells of the sunny room count as windows, with the directions; its box."""
    room, x = sunny.sunny_room(0.2), sunny.SIZE[0]
    sky = Environment(np.ones((32, 64, 3), np.float32), np.ones((32, 64), np.int32))
    field = room.field(np.zeros((len(room.atlas), 3), np.float32), sky)
    cameras = [look_at((0.4, 1.0, 1.0), (x, y, 0.9), 120, 90, 60.0) for y in (0.3, 1.0, 1.7)]
    return (*looked_out_by(cameras, room.scene, sky, usual, *field.outer_box), *field.outer_box)


def test_a_window_is_where_cameras_look_out_to_what_is_brighter_than_the_room():
    windows, directions, low, size = window_seen(0.5)
    cell = np.flatnonzero(windows)
    assert len(cell) and (cell // 576 == 1).all() and (directions[:, 0] > 0).all()
    row, column = np.divmod(cell % 576, 24)
    at = low[1:] + size[1:] * (np.stack([row, column], 1) + 0.5) / 24
    hole = sunny.sides()[1]
    window = np.sort(np.stack([hole.corner, hole.corner + hole.edge_u + hole.edge_v]), 0)
    edge = size[1:] / 24
    assert (at > window[0, 1:] - edge).all() and (at < window[1, 1:] + edge).all()
    assert len(cell) * edge.prod() == pytest.approx(np.prod(window[1, 1:] - window[0, 1:]), rel=0.25)


def test_what_is_no_brighter_than_the_room_is_no_window():
    windows, directions, _, _ = window_seen(2.0)
    assert not windows.any() and not len(directions)


def test_by_a_window_rays_see_the_map_and_by_another_cell_what_that_holds():
    cell = (1 * 24 + 7) * 24 + 11
    found = openings(cell)
    seen = replace(found, windows=np.arange(CELLS) == cell)
    ray = towards(found.panels()[0].corners[0].mean(0))
    assert found(*ray)[1].all() and not seen(*ray)[1].any()


def test_beside_windows_the_map_goes_on_and_away_from_them_it_holds_what_the_rooms_middle_sees():
    observations = np.zeros((64, 128), np.int32)
    observations[30:34, :8] = 3
    sky = Environment(np.full((64, 128, 3), 7, np.float32), observations)
    low_x = np.arange(CELLS) < 576
    filled = replace(openings(), windows=low_x).filled(sky, LOW + SIZE / 2)
    outward = (filled.directions[:, 0] < 0).reshape(64, 128)
    assert (filled.radiance[outward] == 7).all()
    inward = filled.radiance[~outward & (np.arange(64) > 50)[:, None]]
    assert inward == pytest.approx(np.broadcast_to(USUAL, inward.shape), abs=0.01)
