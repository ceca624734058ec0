"""Sheets seen from both sides: which they are, and that each side has a place, light and colour of its own."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.light.emitters import bright_triangles
from addon.core.light.field import LightField
from addon.core.light.irradiance import direct, gather
from addon.core.passes.albedo.albedo import FILLED, fill
from addon.core.scene.creases import edge_angles
from addon.core.scene.elements import make_atlas
from addon.core.scene.model import Mesh
from addon.core.scene.orientation import seen_sides
from addon.core.scene.rays import RayScene
from addon.core.scene.surface import build_surface
from addon.core.scene.two_sides import fronts, laid_apart, substantial, two_sided, with_backs
from tests.core.rooms import DARK, box_sides, look_at, make_room, quad

ROUND = 24


def tube(radius=0.5, height=1.0, count=ROUND, flip=()) -> Mesh:
    """A shade: a tube around the Z axis, open at both ends; outside is front, but for the triangles `flip`."""
    angle = 2 * np.pi * np.arange(count) / count
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], 1)
    vertices = np.concatenate([np.c_[ring, np.full(count, z)] for z in (0, height)])
    a, b = np.arange(count), (np.arange(count) + 1) % count
    triangles = np.concatenate([np.stack([a, b, b + count], 1), np.stack([a, b + count, a + count], 1)])
    triangles = triangles.astype(np.int32)
    flip = np.array(flip, int)
    triangles[flip] = triangles[flip][:, [0, 2, 1]]
    return Mesh(vertices, triangles, np.zeros(len(triangles), np.int32))


def laid_out(mesh: Mesh, size: int) -> np.ndarray:
    """Each triangle in a cell of its own, (t, 3, 2)."""
    edge = int(np.ceil(np.sqrt(len(mesh.triangles))))
    cell = np.arange(len(mesh.triangles))
    corner = np.stack([cell % edge, cell // edge], 1)[:, None]
    return ((corner + np.float32([[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]])) / edge).astype(np.float32)


def outwards(mesh: Mesh) -> np.ndarray:
    """How far each triangle faces away from the Z axis, (t,)."""
    return (mesh.geometry[0] * (mesh.vertices[mesh.triangles].mean(1) * (1, 1, 0))).sum(1)


def shade_views():
    """From without and somewhat above: the near half shows its outside, the far one its inside."""
    return [look_at((3 * np.cos(a), 3 * np.sin(a), 2.2), (0, 0, 0.5), fov=30.0) for a in (0.3, 0.8)]


def test_a_shade_is_a_sheet_though_each_triangle_shows_one_side():
    mesh = tube(flip=(3, 30))
    sides = seen_sides(mesh, shade_views())
    assert sides.both.all()
    facing = outwards(mesh) * sides.sign
    assert (facing > 0).all() or (facing < 0).all()


@pytest.mark.parametrize(
    "rays, told",
    [((100, 0), False), ((96, 4), False), ((94, 6), True), ((3, 3), False), ((580, 18), True), ((980, 18), False)],
)
def test_a_side_seen_by_chance_makes_no_sheet(rays, told):
    mesh = tube()
    seen = np.zeros((2, len(mesh.triangles)), int)
    seen[0, 5], seen[1, 17] = rays
    both, sign = two_sided(mesh, seen)
    assert both.all() == told and both.any() == told
    assert (outwards(mesh) * sign > 0).all()


def test_a_closed_box_is_no_sheet_but_one_without_lid_is():
    box = make_room(box_sides()).mesh
    seen = np.full((2, len(box.triangles)), 50)
    one = replace(box, object_id=np.zeros_like(box.object_id))
    assert not two_sided(one, seen)[0].any()
    open_box = replace(one, triangles=one.triangles[2:], object_id=one.object_id[2:])
    assert two_sided(open_box, seen[:, 2:])[0].all()


def test_moebius_strip_has_no_two_sides():
    count = 12
    angle = 2 * np.pi * np.arange(count) / count
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    way = np.cos(angle / 2)[:, None] * middle + np.sin(angle / 2)[:, None] * (0, 0, 1)
    vertices = np.concatenate([middle - 0.2 * way, middle + 0.2 * way])
    low, high = np.arange(count), np.arange(count) + count
    next_low, next_high = np.r_[low[1:], high[0]], np.r_[high[1:], low[0]]
    triangles = np.concatenate([np.stack([low, next_low, next_high], 1), np.stack([low, next_high, high], 1)])
    mesh = Mesh(vertices, triangles.astype(np.int32), np.zeros(len(triangles), np.int32))
    assert not two_sided(mesh, np.full((2, len(triangles)), 50))[0].any()


def test_little_of_an_object_and_of_the_room_is_left_as_it_is():
    """One leaf of a plant; the same leaf as an object of its own; a wall of a scan that is one object."""
    leaf = quad((0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), 1)
    others = [quad((i, 0, 1), (0.1, 0, 0), (0, 0.1, 0), 1) for i in range(20)]
    room = [quad((0, 0, 2), (5, 0, 0), (0, 5, 0), 0), quad((0, 0, 4), (1, 0, 0), (0, 1, 0), 0)]
    for quads, told in (([leaf, *others, *room], False), ([leaf, *room], True), ([room[1], room[0]], True)):
        both = np.zeros(2 * len(quads), bool)
        both[:2] = True
        np.testing.assert_array_equal(substantial(make_room(quads).mesh, both), both & told)


def test_backs_lie_on_their_fronts_and_face_the_other_way():
    mesh = with_backs(tube(), np.arange(4, 20))
    normal, area = mesh.geometry
    np.testing.assert_allclose(normal[-16:], -normal[4:20], atol=1e-6)
    assert len(mesh.triangles) == 2 * ROUND + 16 and mesh.backs.tolist() == list(range(4, 20))
    single, sheet = fronts(mesh)
    np.testing.assert_array_equal(single.triangles, tube().triangles)
    own, first = mesh.vertices[mesh.triangles], mesh.vertices[single.triangles[sheet]]
    np.testing.assert_array_equal(np.sort(own, 1), np.sort(first, 1))
    assert with_backs(single, np.zeros(0, int)) is single


def test_rays_meet_the_side_that_they_come_from():
    mesh = with_backs(tube(flip=(2,)), np.arange(2 * ROUND))
    scene = RayScene(mesh.vertices, mesh.triangles, mesh.backs)
    angle = np.random.default_rng(0).uniform(0, 2 * np.pi, 400)
    directions = np.stack([np.cos(angle), np.sin(angle), 0.3 * np.cos(7 * angle)], 1)
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    middle = np.broadcast_to(np.float32([0.05, 0.1, 0.5]), directions.shape)
    normal = mesh.geometry[0]
    for origins, way in ((middle, directions), (middle + 3 * directions, -directions)):
        hits = scene.intersect(origins, way)
        assert (hits.triangle >= 0).all()
        assert (np.einsum("ij,ij->i", way, normal[hits.triangle]) < 0).all()
        a, b, c = (mesh.vertices[mesh.triangles[hits.triangle, k]] for k in range(3))
        at = a + hits.u[:, None] * (b - a) + hits.v[:, None] * (c - a)
        np.testing.assert_allclose(at, origins + hits.distance[:, None] * way, atol=1e-5)
    assert scene.intersect(np.float32([[0, 0, 5]]), np.float32([[0, 0, 1]])).triangle.tolist() == [-1]


def test_borders_of_a_sheet_stay_borders():
    angles, single = edge_angles(with_backs(tube(), np.arange(2 * ROUND))), edge_angles(tube())
    assert (single == np.pi / 2).any(1).all()
    np.testing.assert_array_equal(angles[: 2 * ROUND], single)
    np.testing.assert_array_equal(np.sort(angles[2 * ROUND :], 1), np.sort(single, 1))


def test_light_of_either_side_goes_its_own_way():
    """A shade white inside and dark outside lights what is within it, and nothing without; aimed or gathered."""
    surface = build_surface(tube(), shade_views(), laid_out, texel_size=0.05, coarse_unseen=False)
    atlas = surface.atlas
    inside = outwards(surface.mesh)[atlas.triangle] < 0
    assert 0.45 < inside.mean() < 0.55
    np.testing.assert_array_equal(inside, atlas.back != atlas.back[~inside][0])
    field = LightField(surface.mesh, atlas, surface.scene, np.where(inside[:, None], 3, np.zeros(3)), DARK)
    place = np.float32([[0, 0, 0.5], [2, 0, 0.5], [-3, 0.1, 0.2]])
    normal = np.float32([[1, 0, 0], [-1, 0, 0], [1, 0, 0]])
    _, _, element = field.along(place, normal)
    assert inside[element].tolist() == [True, False, False]
    bright = bright_triangles(field)
    for emitter_rays in (0, 64):
        total, _, _ = gather(field, bright, place, normal, 256, emitter_rays, 1)
        total += direct(field, bright, place, normal, 256, emitter_rays, 2)[0]
        # From its middle the tube covers all but the caps: 1 - 2 pi / 4 (1 - cos 45 deg) of the half sphere or so.
        assert 0.6 * 3 * np.pi < total[0].mean() < 3 * np.pi
        assert total[1:].max() < 1e-6


def test_each_side_is_filled_from_its_own():
    mesh = with_backs(tube(), np.arange(2 * ROUND))
    atlas = make_atlas(mesh, laid_out(mesh, 256), 256)
    truth = np.where(atlas.back[:, None], np.float32(0.8), np.float32(0.2)) * np.ones(3, np.float32)
    valid = np.random.default_rng(0).random(len(atlas)) < 0.5
    found = fill(atlas, np.where(valid[:, None], truth, np.nan), valid, {0: "shade"}, set())
    assert (found.origin[~valid] == FILLED).all()
    np.testing.assert_allclose(found.rho, truth, rtol=1e-3)
    # A side that nobody saw takes the other one's.
    found = fill(atlas, np.where(atlas.back[:, None], np.nan, truth), ~atlas.back, {0: "shade"}, set())
    np.testing.assert_allclose(found.rho, 0.2, rtol=1e-3)
    assert (found.origin[atlas.back] == FILLED).all()


@pytest.mark.parametrize("shift", [0.0, 1e5])
def test_laid_apart_leaves_fronts_and_moves_backs_behind_them(shift):
    mesh = with_backs(tube(flip=(1, 5)), np.arange(2 * ROUND))
    vertices = tube().vertices + shift
    found = laid_apart(mesh, vertices)
    count = 2 * ROUND
    np.testing.assert_array_equal(found.vertices[found.triangles[:count]], vertices[mesh.triangles[:count]])
    normal = found.geometry[0]
    apart = found.vertices[found.triangles[:count]].mean(1) - found.vertices[found.triangles[count:]].mean(1)
    gap = (apart * normal[:count]).sum(1)
    least = 4e-5 * np.linalg.norm(np.ptp(vertices, axis=0))
    assert (gap > 0.5 * least).all() and gap.max() < max(2 * least, 0.1)
    assert (np.unique(np.float32(found.vertices[found.triangles[count:]]).reshape(-1, 3), axis=0).shape[0]) > ROUND
    np.testing.assert_allclose(normal[count:], -normal[:count], atol=0.02 if shift else 1e-3)


def test_without_such_a_sheet_nothing_changes():
    room = make_room([*box_sides(), quad((1, 1, 0.5), (1, 0, 0), (0, 1, 0), 9)])
    views = [look_at((0.5, 0.5, 2.0), (2, 2, 0.5))]
    surface = build_surface(room.mesh, views, lambda mesh, size: room.uv)
    assert surface.mesh.backs is None and surface.atlas.back is None and len(surface.backs) == 0
    assert surface.first_uv is surface.uv or np.array_equal(surface.first_uv, surface.uv)
