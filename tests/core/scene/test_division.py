"""A building in parts: each triangle in one, and all that a part's light and frames need besides it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.scene.division import divided, parts_for, seen_by
from addon.core.scene.params import DIVISION, SPARSE
from addon.core.scene.rays import RayScene
from addon.core.scene.surface import build_surface
from tests.core.rooms import all_round, around, box_sides, make_room, quad, split
from tests.core.scene.test_sparse_layout import one_by_one

LENGTH = 4.0
DOOR = (0.3, 0.6), (0.0, 0.7)


def moved(sides, k, gap):
    """A room's sides, the k-th along x, with objects of its own."""
    shift = np.array([k * (LENGTH + gap), 0, 0])
    return [replace(side, corner=side.corner + shift, object_id=side.object_id + 10 * k) for side in sides]


def row_of(count, gap=0.5):
    """Closed rooms beside each other, cut up finely."""
    return [piece for k in range(count) for side in moved(box_sides(), k, gap) for piece in split(side, 4)]


def two_with_a_door():
    """Two rooms that share a wall with a hole in it; a cupboard stands in the second."""
    quads = []
    for k, wall in ((0, 3), (1, 2)):
        for side in moved(box_sides(), k, 0.0):
            flat = side.object_id % 10 == wall
            # Either wall's edges run along z and y, the other way round.
            hole = DOOR[::-1] if wall == 3 else DOOR
            quads += around(side, *hole) if flat else split(side, 4)
    return quads


def cameras(count, gap):
    return [camera for k in range(count) for camera in all_round((k * (LENGTH + gap) + 2, 1.5, 1.2), 64)]


def parts_of(quads, count, gap, parts):
    room, views = make_room(quads), cameras(count, gap)
    seen = seen_by(room.mesh, room.scene, views)
    return room, views, seen, divided(room.mesh, room.scene, seen, parts)


def near(part):
    return part.triangle[~part.far]


def test_closed_rooms_come_apart_with_their_frames():
    room, views, _, parts = parts_of(row_of(3), 3, 0.5, 3)
    assert len(parts) == 3
    for part in parts:
        (k,) = np.unique(room.mesh.object_id[part.triangle] // 10)
        assert not part.far.any()
        assert part.frames.tolist() == list(range(6 * k, 6 * k + 6))
    assert np.sort(np.concatenate([near(part) for part in parts])).tolist() == list(range(len(room.mesh.triangles)))


@pytest.mark.parametrize("count", [1, 2, 5])
def test_each_triangle_is_one_part_s_whatever_their_number(count):
    room, _, _, parts = parts_of(two_with_a_door(), 2, 0.0, count)
    assert len(parts) == count
    assert np.sort(np.concatenate([near(part) for part in parts])).tolist() == list(range(len(room.mesh.triangles)))


def test_a_part_s_frames_and_its_light_meet_what_they_met_before():
    """Rays of its frames, and from its surface, hit the same triangles as in the whole building."""
    room, views, seen, parts = parts_of(two_with_a_door(), 2, 0.0, 2)
    rng = np.random.default_rng(1)
    for part in parts:
        assert part.far.any()
        scene = RayScene(room.mesh.vertices, room.mesh.triangles[part.triangle])
        own = np.flatnonzero(np.isin(seen.triangle, near(part)))
        start = np.repeat(own, 16)
        direction = rng.standard_normal((len(start), 3)).astype(np.float32)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        direction *= np.sign(np.einsum("ij,ij->i", direction, seen.normal[start]))[:, None]
        origins = [scene.off_surface(seen.position[start], seen.normal[start])]
        directions = [direction]
        for i in part.frames:
            rays = views[i].directions(views[i].pixel_centres(4))
            origins.append(np.broadcast_to(views[i].centre, rays.shape).astype(np.float32))
            directions.append(rays)
        rays = np.concatenate(origins), np.concatenate(directions)
        whole, alone = room.scene.intersect(*rays).triangle, scene.intersect(*rays).triangle
        same = np.where(alone >= 0, part.triangle[alone], -1) == whole
        assert same.mean() > 0.9999


def test_what_lights_a_part_through_a_door_is_seen_by_its_frames():
    """One frame of the second room looks at each of its sides: the first takes those that show what its rays meet."""
    room, _, _, parts = parts_of(two_with_a_door(), 2, 0.0, 2)
    first = next(part for part in parts if (room.mesh.object_id[near(part)] < 10).all())
    assert (first.frames < 6).any()
    assert (first.frames >= 6).any()


def test_a_large_object_is_cut_and_small_ones_are_whole():
    """A floor of one object under three rooms, with a row of boxes on it."""
    floor = split(quad((0, 0, 0), (13, 0, 0), (0, 3, 0), 99), 24)
    sides = [side for side in row_of(3) if side.object_id % 10]
    room, _, _, parts = parts_of([*sides, *floor], 3, 0.5, 3)
    with_floor = [part for part in parts if (room.mesh.object_id[near(part)] == 99).any()]
    assert len(with_floor) == 3
    others = [np.unique(room.mesh.object_id[near(part)]) for part in parts]
    ids, number = np.unique(np.concatenate(others), return_counts=True)
    assert (number[ids != 99] == 1).all()


def test_more_memory_makes_fewer_parts():
    room = make_room(row_of(3))
    seen = seen_by(room.mesh, room.scene, cameras(3, 0.5))
    of_all = DIVISION.each * len(seen.number) * SPARSE.cell**2
    counts = [parts_for(seen, DIVISION.base + share * of_all) for share in (0.1, 0.5, 2.0)]
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 1
    assert counts[0] >= 10


def test_what_is_far_takes_few_elements():
    room, views, _, parts = parts_of(two_with_a_door(), 2, 0.0, 2)
    whole = build_surface(room.mesh, views, one_by_one, texel_size=0.02)
    for part in parts:
        ids = room.mesh.object_id[part.triangle] + np.where(part.far, 100, 0)
        mesh = replace(room.mesh, triangles=room.mesh.triangles[part.triangle], object_id=ids, far=part.far)
        surface = build_surface(mesh, [views[i] for i in part.frames], one_by_one, texel_size=0.02)
        of_near, area = ~surface.mesh.far[surface.atlas.triangle], surface.atlas.area
        for elements, triangles in ((of_near, ~surface.mesh.far), (~of_near, surface.mesh.far)):
            assert area[elements].sum() == pytest.approx(surface.mesh.geometry[1][triangles].sum(), rel=0.02)
        density = [chosen.sum() / area[chosen].sum() for chosen in (of_near, ~of_near)]
        assert density[1] < density[0] / 10
        assert len(surface.atlas) < 0.75 * len(whole.atlas)
