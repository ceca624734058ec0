"""Light by the cells of the room's box: what rays find there, and the panels that stand for what is bright."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.environment import Environment
from addon.core.light.openings import CELLS, Openings, exits

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
