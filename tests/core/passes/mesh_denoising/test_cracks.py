"""Cracks along borders are closed; what only lies near stays."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.mesh_denoising.cracks import border_edges, closed
from addon.core.passes.mesh_denoising.denoise import denoised
from addon.core.scene.mesh_noise import noise_of
from addon.core.scene.rays import RayScene
from tests.core.passes.mesh_denoising.test_denoise import noisy
from tests.core.rooms import make_room, quad, split

NOISE = 0.003


def fan(points, below) -> tuple[np.ndarray, np.ndarray]:
    """A frame of one quad above the x axis, and a wall under it whose upper border has `points` ((k, 3)) along it."""
    along = np.asarray(points, float)
    low = np.array([[0, -below, 0], [1, -below, 0]])
    vertices = np.concatenate([[[0, 0, 0], [1, 0, 0], [1, 0.3, 0], [0, 0.3, 0]], along, low])
    k = len(along)
    top = [0, *range(4, 4 + k), 1]
    faces = [[0, 1, 2], [0, 2, 3]]
    faces += [[4 + k, b, a] for a, b in zip(top, top[1:])] + [[4 + k, 5 + k, 1]]
    return vertices, np.array(faces)


def test_points_go_onto_the_edge_that_they_run_along():
    points, faces = fan([[0.3, 0.004, 0.002], [0.6, -0.003, -0.003]], 0.4)
    moved = closed(points, faces, NOISE)
    assert np.allclose(moved[4:6], [[0.3, 0, 0], [0.6, 0, 0]], atol=1e-9)
    others = np.delete(np.arange(len(points)), [4, 5])
    assert np.array_equal(moved[others], points[others])


@pytest.mark.parametrize(
    "along, below",
    [
        ([[0.3, 0.02, 0], [0.6, 0.02, 0]], 0.4),  # farther than twice the noise
        ([[0.3, 0.004, 0], [0.6, 0.004, 0]], 0.01),  # a strip of a moulding
    ],
)
def test_what_only_lies_near_stays(along, below):
    points, faces = fan(along, below)
    assert np.array_equal(closed(points, faces, NOISE), points)


def test_a_border_that_only_ends_at_an_edge_stays():
    """One tip near another part's edge is no crack."""
    frame = np.array([[0, 0, 0], [1, 0, 0], [1, 0.3, 0], [0, 0.3, 0.0]])
    tip = np.array([[0.5, -0.003, 0.003], [0.3, -0.4, 0.2], [0.7, -0.4, 0.2]])
    points, faces = np.concatenate([frame, tip]), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    assert np.array_equal(closed(points, faces, NOISE), points)


def test_nothing_without_borders():
    _, faces = fan([[0.5, 0, 0]], 0.4)
    edges, opposite = border_edges(faces)
    around = [(0, 1), (0, 3), (0, 4), (0, 5), (1, 2), (1, 4), (1, 6), (2, 3), (5, 6)]
    assert sorted(map(tuple, edges.tolist())) == around
    assert len(opposite) == len(edges)
    box = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    points = np.random.default_rng(0).normal(size=(4, 3))
    assert not len(border_edges(box)[0])
    assert np.array_equal(closed(points, box, NOISE), points)


def test_no_light_comes_through_a_denoised_wall():
    """A window's frame of two triangles a side, in a wall of many: rays from outside find nothing between them."""
    wall = split(quad((-1, 0, -1), (3, 0, 0), (0, 0, 1), 0), 12) + split(quad((-1, 0, 1), (3, 0, 0), (0, 0, 1), 0), 12)
    sides = [quad((-1, 0, 0), (1, 0, 0), (0, 0, 1), 0), quad((1, 0, 0), (1, 0, 0), (0, 0, 1), 0)]
    frame = [quad((0, 0, 0), (0.2, 0, 0), (0, 0, 1), 1), quad((0.8, 0, 0), (0.2, 0, 0), (0, 0, 1), 1)]
    frame += [quad((0.2, 0, 0), (0.6, 0, 0), (0, 0, 0.2), 1), quad((0.2, 0, 0.8), (0.6, 0, 0), (0, 0, 0.2), 1)]
    mesh = make_room([*wall, *sides, *frame], 0.1).mesh
    scanned = noisy(mesh, 0.004, seed=2)
    # Rays that cross the line where wall and window meet, aslant, so that a crack in either direction lets them pass.
    x, z = np.meshgrid(np.linspace(-0.9, 1.9, 1400), np.linspace(-0.603, -0.597, 7))
    origin = np.stack([x.ravel(), np.full(x.size, -1.0), z.ravel()], 1).astype(np.float32)
    way = np.broadcast_to(np.float32([0, 1, 0.6]) / np.float32(np.hypot(1, 0.6)), origin.shape)

    def passing(vertices: np.ndarray) -> int:
        return int((RayScene(vertices, mesh.triangles).intersect(origin, way).triangle < 0).sum())

    assert passing(mesh.vertices) == 0 and passing(scanned.vertices) > 20
    assert passing(denoised(scanned, noise_of(scanned))) < passing(scanned.vertices) / 5
