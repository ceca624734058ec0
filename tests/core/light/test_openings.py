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
    observations = np.zeros((8, 16), np.int32)
    observations[:4] = 3
    sky = Environment(np.full((8, 16, 3), 7, np.float32), observations)
    filled = openings(*range(5 * 576, CELLS)).without_bright().filled(sky, LOW + SIZE / 2).radiance
    assert (filled[:4] == 7).all()
    assert filled[4:] == pytest.approx(np.broadcast_to(USUAL, (4, 16, 3)))


@pytest.mark.parametrize("side", range(6))
def test_a_panel_lies_before_what_closes_the_mesh(side):
    axis, inward = side // 2, np.eye(3, dtype=np.float32)[side // 2] * (-1) ** (side % 2)
    bright = openings((side * 24 + 7) * 24 + 11)
    place = LOW + SIZE / 2
    place[axis] = (LOW + SIZE * (side % 2))[axis] + 0.1 * inward[axis]
    (panel,) = bright.panels(place[None], inward[None])
    assert ((panel.corners - place) @ inward > 0).all()
    assert np.abs((panel.corners - bright.panels()[0].corners) @ inward - 0.1).max() < 0.01
