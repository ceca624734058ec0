"""Atlas and surface elements: every piece of surface has its element, of its own object."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.scene.atlas import Atlas
from addon.core.scene.elements import Crumbs, ElementLookup, find_elements, make_atlas, shown_uv, uv_scale
from addon.core.scene.model import Mesh
from tests.core.rooms import box_sides, make_room, quad


@pytest.fixture(scope="module")
def room():
    return make_room(box_sides((4, 3, 2.5)), 0.1)


def barycentric(mesh: Mesh, triangle, points):
    a, b, c = (mesh.vertices[mesh.triangles[triangle, i]] for i in range(3))
    e, f, p = b - a, c - a, points - a
    ee, ef, ff = ((x * y).sum(1) for x, y in ((e, e), (e, f), (f, f)))
    pe, pf = (p * e).sum(1), (p * f).sum(1)
    det = ee * ff - ef * ef
    return (pe * ff - pf * ef) / det, (pf * ee - pe * ef) / det


def test_every_square_metre_is_shared_out(room):
    sums = np.bincount(room.atlas.triangle, room.atlas.area, len(room.mesh.triangles))
    assert np.allclose(sums, room.mesh.geometry[1], rtol=1e-4)
    assert room.atlas.area.sum() == pytest.approx(2 * (12 + 10 + 7.5), rel=1e-4)


def test_one_element_for_each_texel_of_the_islands(room):
    assert len(room.atlas) == 5900  # 59 square metres in texels of 10 cm
    assert (np.diff(room.atlas.texel) > 0).all()
    assert room.atlas.area == pytest.approx(0.01, rel=0.1)


def test_elements_lie_on_their_triangles_at_their_texel(room):
    atlas, mesh = room.atlas, room.mesh
    u, v = barycentric(mesh, atlas.triangle, atlas.position.astype(float))
    assert (np.minimum(np.minimum(u, v), 1 - u - v) > -1e-4).all()
    height = ((atlas.position - mesh.vertices[mesh.triangles[atlas.triangle, 0]]) * atlas.normal).sum(1)
    assert np.abs(height).max() < 1e-5
    corners = atlas.uv[atlas.triangle]
    at = corners[:, 0] + u[:, None] * (corners[:, 1] - corners[:, 0]) + v[:, None] * (corners[:, 2] - corners[:, 0])
    texel = np.floor(at * atlas.size).astype(int)
    assert np.array_equal(texel[:, 1] * atlas.size + texel[:, 0], atlas.texel)


def test_normals_point_into_the_box_and_objects_match(room):
    inward = np.float32([2, 1.5, 1.25]) - room.atlas.position
    assert (np.einsum("ij,ij->i", inward, room.atlas.normal) > 0).all()
    assert np.allclose(np.linalg.norm(room.atlas.normal, axis=1), 1, atol=1e-6)
    assert np.array_equal(room.atlas.object_id, room.mesh.object_id[room.atlas.triangle])


def test_uv_scale_is_texels_over_metres(room):
    assert uv_scale(room.mesh, room.uv) * room.size == pytest.approx(10, rel=1e-5)


def test_geometry_of_a_known_triangle():
    mesh = Mesh(np.array([[0.0, 0, 0], [0, 2, 0], [0, 0, 3]]), np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32))
    normal, area = mesh.geometry
    assert normal.tolist() == [[1, 0, 0]] and area.tolist() == [3]


def test_padding_shows_the_nearest_element_everywhere(room):
    atlas = room.atlas
    assert np.array_equal(atlas.padding[atlas.texel], np.arange(len(atlas)))
    shown = atlas.image(atlas.object_id, empty=-1)
    own = np.full(atlas.size**2, -1)
    own[atlas.texel] = atlas.object_id
    own = own.reshape(atlas.size, atlas.size)
    for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):  # one texel beyond an island there is the island's own value
        beside = np.roll(own, shift, (0, 1))
        edge = (own < 0) & (beside >= 0)
        assert edge.any() and np.array_equal(shown[edge], beside[edge])
    assert (shown[own >= 0] == own[own >= 0]).all()


def test_image_puts_row_0_at_the_bottom():
    floor = make_room([quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0)], 0.25)
    image = floor.atlas.image(floor.atlas.position[:, 1])
    rows, _ = np.divmod(floor.atlas.texel, floor.atlas.size)
    assert image[rows.min()].max() == pytest.approx(0.125) and image[rows.max()].max() == pytest.approx(0.875)
    assert floor.atlas.image(floor.atlas.normal).shape == (floor.atlas.size, floor.atlas.size, 3)


def test_image_leaves_empty_texels_empty():
    none = np.zeros(0)
    padding = np.int32([0, -1, -1, -1])
    atlas = Atlas(2, none, np.array([0]), none, none, none, none, none, padding)
    assert atlas.image(np.float32([5]), empty=-2).ravel().tolist() == [5, -2, -2, -2]


def points_on(mesh: Mesh, count: int):
    rng = np.random.default_rng(0)
    triangle = np.repeat(np.arange(len(mesh.triangles)), count)
    u, v = rng.random((2, len(triangle)), np.float32)
    over = u + v > 1
    u[over], v[over] = 1 - u[over], 1 - v[over]
    return triangle, u, v


def test_lookup_finds_the_element_at_the_place(room):
    triangle, u, v = points_on(room.mesh, 500)
    element = ElementLookup(room.mesh, room.atlas)(triangle, u, v)
    a, b, c = (room.mesh.vertices[room.mesh.triangles[triangle, i]] for i in range(3))
    where = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    away = np.abs(room.atlas.position[element] - where).max(1)
    assert np.array_equal(room.atlas.object_id[element], room.mesh.object_id[triangle])
    assert away.max() < 0.0501  # half a texel


@pytest.fixture(scope="module")
def crumbs():
    """A square of object 0; beside it in the atlas, nearer than its own object's square, a sliver and a crumb of 1."""
    vertices = np.array(
        [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]  # object 0
        + [[5.0, 0, 0], [6, 0, 0], [6, 1, 0], [5, 1, 0]]  # object 1
        + [[5.0, 0, 1], [6, 0, 1], [5, 0.001, 1]]  # a sliver of object 1
        + [[5.5, 0.5, 1], [5.501, 0.5, 1], [5.5, 0.501, 1]]  # a crumb of object 1
        + [[9.0, 0, 0], [9.001, 0, 0], [9, 0.001, 0]]  # object 2 is nothing but a crumb
    )
    triangles = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7), (8, 9, 10), (11, 12, 13), (14, 15, 16)], np.int32)
    uv = np.float32(
        [[(2, 2), (12, 2), (12, 12)], [(2, 2), (12, 12), (2, 12)]]
        + [[(18, 18), (28, 18), (28, 28)], [(18, 18), (28, 28), (18, 28)]]
        + [[(2, 13.11), (12, 13.11), (2, 13.12)], [(14.11, 5.11), (14.12, 5.11), (14.11, 5.12)]]
        + [[(15.61, 5.61), (15.62, 5.61), (15.61, 5.62)]]
    )
    mesh = Mesh(vertices, triangles, np.int32([0, 0, 1, 1, 1, 1, 2]))
    return mesh, make_atlas(mesh, uv / 32, 32)


def test_surface_without_a_texel_shows_its_own_object(crumbs):
    mesh, atlas = crumbs
    assert not np.isin([5, 6], atlas.triangle).any()  # or the test tests nothing
    triangle, u, v = points_on(mesh, 50)
    element = ElementLookup(mesh, atlas)(triangle, u, v)
    has_own = triangle < 6
    assert np.array_equal(atlas.object_id[element[has_own]], mesh.object_id[triangle[has_own]])
    away = np.linalg.norm(atlas.position[element[triangle == 5]] - [5.5, 0.5, 0], axis=1)
    assert away.max() < 0.1  # the nearest element of the object's other triangles
    assert (element >= 0).all()  # object 2 has no element at all and takes anybody's


def test_a_renderer_sees_the_same_object_by_the_written_coordinates(crumbs):
    """The crumb lies over object 0's padding; what has texels stays where it is."""
    mesh, atlas = crumbs
    uv = shown_uv(mesh, atlas)
    shown = atlas.object_id[atlas.padding.reshape(32, 32)[tuple((uv * 32).astype(int)[..., ::-1].transpose(2, 0, 1))]]
    assert (shown[:6] == mesh.object_id[:6, None]).all()
    assert np.array_equal(uv[:4], atlas.uv[:4]) and not np.array_equal(uv[5], atlas.uv[5])
    assert np.allclose((uv[5] * 32) % 1, 0.5)  # in a texel's middle, so that no neighbour is mixed in


def test_a_sliver_between_texel_centres_gets_elements_at_its_border():
    """Rays at the centres alone would lose it; the further samples in a texel find it."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0.03, 0]])
    mesh = Mesh(vertices, np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32))
    uv = np.float32([[(2, 4.7), (12, 4.7), (2, 5.0)]]) / 16
    atlas = make_atlas(mesh, uv, 16)
    assert 3 <= len(atlas) <= 10
    assert (atlas.texel // 16 == 4).all()
    assert atlas.area.sum() == pytest.approx(0.015, rel=1e-5)


def test_a_mesh_of_crumbs_alone():
    """A mesh of two million triangles in a small atlas has none that is larger than a texel."""
    room = make_room(box_sides(), 0.5)
    count = len(room.mesh.triangles)
    corner = np.stack([np.arange(count) * 3 + 1, np.ones(count, int)], 1)

    class AllSeen:
        def seen(self, position, triangle):
            return np.ones(len(position), bool)

        def coarse(self, position, triangle):
            return np.zeros(len(position), np.uint64)

    found = find_elements(room.mesh, room.uv, 64, AllSeen(), Crumbs(np.arange(count), np.arange(count), corner))
    assert sorted(found.triangle) == list(range(count))
    assert found.area.sum() == pytest.approx(room.mesh.geometry[1].sum(), rel=1e-5)
