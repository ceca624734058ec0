"""Rays: what they hit, how far, and that they leave their own surface."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.directions import cosine_hemisphere, sobol
from addon.core.scene.rays import RayScene
from addon.core.scene.tangent_frame import to_world
from tests.core.rooms import box_sides, make_room, quad

UP, DOWN = np.float32([[0, 0, 1]]), np.float32([[0, 0, -1]])


@pytest.fixture(scope="module")
def sheets() -> RayScene:
    """Two squares, 2 m wide, at heights 0 and 1."""
    return make_room([quad((-1, -1, z), (2, 0, 0), (0, 2, 0), z) for z in (0, 1)]).scene


def test_first_hit_is_the_nearest(sheets):
    hits = sheets.intersect(np.float32([[0.3, -0.2, 3], [0.3, -0.2, 0.5], [5, 0, 3]]), np.repeat(DOWN, 3, 0))
    assert (hits.triangle // 2).tolist() == [1, 0, -1]
    assert np.allclose(hits.distance[:2], [2, 0.5], atol=1e-6) and np.isinf(hits.distance[2])


def test_barycentric_coordinates_are_of_the_second_and_third_corner():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    scene = RayScene(vertices, np.array([[0, 1, 2]]))
    hits = scene.intersect(np.float32([[0.2, 0.7, 1]]), DOWN)
    assert hits.u[0] == pytest.approx(0.2, abs=1e-6) and hits.v[0] == pytest.approx(0.7, abs=1e-6)


def test_both_sides_are_hit(sheets):
    hits = sheets.intersect(np.float32([[0.1, 0.2, -1]]), UP)
    assert hits.triangle[0] // 2 == 0 and hits.distance[0] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize(("reach", "blocked"), [(0.99, False), (1.01, True), (np.inf, True)])
def test_occlusion_counts_up_to_its_distance_only(sheets, reach, blocked):
    origins = np.float32([[0.1, 0.2, 2]])
    assert sheets.occluded(origins, DOWN, np.float32([reach])).tolist() == [blocked]


def test_no_rays_give_no_hits(sheets):
    none = np.zeros((0, 3), np.float32)
    assert len(sheets.intersect(none, none).triangle) == 0
    assert len(sheets.occluded(none, none, np.zeros(0, np.float32))) == 0


@pytest.mark.parametrize("shift", [0, 300])
def test_rays_leave_their_own_surface(shift):
    """Also in a room far from the origin, where float32 is coarse."""
    sides = [quad(q.corner + shift, q.edge_u, q.edge_v, q.object_id) for q in box_sides()]
    room = make_room(sides, 0.25)
    atlas = room.atlas
    rays = 64
    directions = to_world(cosine_hemisphere(sobol(rays, 1))[None], atlas.normal).reshape(-1, 3)
    origins = np.repeat(room.scene.off_surface(atlas.position, atlas.normal), rays, 0)
    hits = room.scene.intersect(origins, directions)
    own = room.mesh.object_id[hits.triangle] == np.repeat(atlas.object_id, rays)
    assert (hits.triangle >= 0).all()
    assert not own.any()  # a flat wall can't be hit from itself


def test_without_the_offset_they_do_not():
    """The reason for `off_surface`; if this fails, embreex has learnt a lower limit of distance."""
    room = make_room(box_sides(), 0.25)
    slanted = room.atlas.normal + np.roll(room.atlas.normal, 1, 1)
    slanted /= np.linalg.norm(slanted, axis=1, keepdims=True)
    hits = room.scene.intersect(room.atlas.position, slanted)
    assert (room.mesh.object_id[hits.triangle] == room.atlas.object_id).any()
