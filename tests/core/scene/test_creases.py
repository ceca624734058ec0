"""Where a mesh bends, and what is in doubt for it."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.scene.atlas import Atlas
from addon.core.scene.creases import crease_error, edge_angles
from addon.core.scene.model import Mesh
from addon.core.scene.params import CREASES
from addon.core.scene.two_sides import with_backs

TEXEL = 0.01


def folded(angle: float, turned: bool = False, apart: bool = False) -> Mesh:
    """Two squares of a metre that meet at x = 1 under `angle`; windings alike or not, vertices listed once or twice."""
    c, s = np.cos(angle), np.sin(angle)
    flat = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    bent = [(1, 0, 0), (1 + c, 0, s), (1 + c, 1, s), (1, 1, 0)]
    second = [(4, 6, 5), (4, 7, 6)] if turned else [(4, 5, 6), (4, 6, 7)]
    vertices = np.array(flat + bent, float)
    if not apart:
        second = [tuple({4: 1, 7: 2}.get(i, i) for i in t) for t in second]
    triangles = np.array([(0, 1, 2), (0, 2, 3), *second], np.int32)
    return Mesh(vertices, triangles, np.zeros(4, np.int32))


def elements(points: list, triangle: list) -> Atlas:
    """An atlas of which only places and triangles matter."""
    n = len(points)
    none = np.zeros(n, np.int32)
    return Atlas(1, np.zeros((4, 3, 2), np.float32), none, np.int32(triangle), np.float32(points),
                 np.tile(np.float32([0, 0, 1]), (n, 1)), none, np.full(n, TEXEL**2, np.float32), none)  # fmt: skip


@pytest.mark.parametrize("angle", [0.0, 0.05, 0.5, np.pi / 2])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("apart", [False, True])
def test_the_angle_at_a_fold(angle, turned, apart):
    angles = edge_angles(folded(angle, turned, apart))
    assert angles[0, 0] == pytest.approx(angle, abs=1e-3)  # edge 1-2, opposite corner 0
    assert angles[0, 1] == pytest.approx(0, abs=1e-3)  # the square's diagonal
    assert angles[1, 0] == pytest.approx(np.pi / 2)  # a border
    assert angles.shape == (4, 3)


def test_three_sheets_at_one_edge_have_no_flat_one():
    mesh = folded(0.0)
    third = np.array([(1, 0, 1), (1, 1, 1)], float)
    mesh = Mesh(np.concatenate([mesh.vertices, third]), np.concatenate([mesh.triangles, [[1, 2, len(mesh.vertices)]]]),
                np.zeros(5, np.int32))  # fmt: skip
    assert edge_angles(mesh).max() == pytest.approx(np.pi / 2)


def test_doubt_is_full_at_a_crease_and_gone_beyond_its_reach():
    mesh = folded(np.pi / 2)
    off = np.array([0.0, 0.5, 0.99 * CREASES.reach, 1.01 * CREASES.reach, 20]) * TEXEL
    atlas = elements([(1 - x, 0.4, 0) for x in off], [0] * 5)
    relative_error = crease_error(mesh, atlas, TEXEL)
    assert relative_error[0] == pytest.approx(CREASES.most_error) and (np.diff(relative_error) <= 0).all()
    assert relative_error[2] > 0 and (relative_error[3:] == 0).all()


def test_a_flat_surface_is_not_in_doubt():
    atlas = elements([(0.999, 0.4, 0), (0.5, 0.5, 0)], [0, 0])
    assert (crease_error(folded(0.0), atlas, TEXEL) == 0).all()


def test_slivers_tell_of_no_bend():
    mesh = folded(0.0)
    vertices = np.concatenate([mesh.vertices, [(0.5, -1e-5, 3e-6)]])  # beside the edge from corner 0 to 1
    with_sliver = Mesh(vertices, np.concatenate([mesh.triangles, [[0, len(vertices) - 1, 1]]]), np.zeros(5, np.int32))
    angles = edge_angles(with_sliver)
    assert angles[0, 2] == 0 and (angles[4] == 0).all() and angles[1, 0] == pytest.approx(np.pi / 2)


def test_what_is_asked_for_is_the_same_as_of_the_whole():
    rng = np.random.default_rng(0)
    grid = np.arange(49).reshape(7, 7)
    a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    bumpy = Mesh(rng.random((49, 3)), triangles, np.zeros(72, np.int32))
    whole = edge_angles(with_backs(bumpy, np.arange(0, 72, 5)))
    for share in (0.05, 0.5):
        wanted = rng.random(len(whole)) < share
        some = edge_angles(with_backs(bumpy, np.arange(0, 72, 5)), wanted)
        np.testing.assert_array_equal(some[wanted], whole[wanted])
