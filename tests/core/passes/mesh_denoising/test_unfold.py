"""Crowded points keep the shape that they have together; few points on a thin thing keep their places."""

from __future__ import annotations

import numpy as np

from addon.core.passes.mesh_denoising.unfold import unfolded
from addon.core.scene.model import Mesh
from addon.core.scene.weld import point_normals, welded
from tests.core.passes.mesh_denoising.test_denoise import NOISE, noisy, rms, smoothed, sphere, tilted


def swept(profile: np.ndarray, stations: np.ndarray, closed: bool = False) -> Mesh:
    """A profile ((k, 2): y, z) swept along x, with vertices at the stations only."""
    k, n = len(profile), len(stations)
    vertices = np.concatenate([np.c_[np.full(k, x), profile] for x in stations])
    along, across = np.meshgrid(np.arange(n - 1), np.arange(k if closed else k - 1), indexing="ij")
    a = (along * k + across).ravel()
    b = (along * k + (across + 1) % k).ravel()
    triangles = np.concatenate([np.c_[a, b, b + k], np.c_[a, b + k, a + k]])
    return Mesh(vertices, triangles, np.zeros(len(triangles), np.int32))


def quarter_round(radius: float, parts: int) -> np.ndarray:
    angle = np.linspace(0, np.pi / 2, parts)
    return radius * np.c_[np.cos(angle), np.sin(angle)]


def board_with_rounded_top() -> Mesh:
    """A skirting: 12 cm high, its top of strips that are 1 mm wide and half a metre long."""
    top = quarter_round(0.025, 40) + [0, 0.12]
    return swept(np.concatenate([[[0.025, 0]], top]), np.arange(0, 4.1, 0.5))


def test_narrow_strips_are_smooth_again():
    board = board_with_rounded_top()
    mesh = noisy(board)
    found = smoothed(mesh)
    strips = np.ptp(board.vertices[board.triangles][..., 2], axis=1) < 0.01
    assert np.median(tilted(mesh, board)[strips]) > 60
    assert np.median(tilted(found, board)[strips]) < 35
    assert rms(found.vertices - board.vertices) < 0.8 * rms(mesh.vertices - board.vertices)


def test_a_small_thing_scanned_finely_keeps_its_size():
    """A ball of 3 cm with edges of 2 to 3 millimetres, noise of 5."""
    ball = sphere(0.03, 20)
    mesh = noisy(ball)
    found = smoothed(mesh)
    assert np.median(tilted(mesh, ball)) > 60 and np.median(tilted(found, ball)) < 12
    radius = np.linalg.norm(found.vertices, axis=1)
    assert abs(radius.mean() / 0.03 - 1) < 0.05 and radius.std() < 0.4 * NOISE


def test_a_thin_frame_does_not_shrink():
    """A bar of 2 by 1 cm under 5 mm of noise: its four edges are all the points that there are."""
    bar = swept(np.array([[0, 0], [0.02, 0], [0.02, 0.01], [0, 0.01]]), np.arange(0, 2.1, 0.5), closed=True)
    points, faces, _ = welded(bar)
    found, crowded = unfolded(points, faces, NOISE)
    assert not crowded.any()
    out = ((found - points) * point_normals(points, faces)).sum(1)
    assert np.abs(out).max() < NOISE / 2


def test_points_far_apart_stay_to_the_last_digit():
    points, faces, _ = welded(sphere(3.0, 10))
    found, crowded = unfolded(points, faces, 0.001)
    assert not crowded.any() and np.abs(found - points).max() < 1e-6


def test_points_without_triangles_stay():
    points, faces, _ = welded(board_with_rounded_top())
    lone = np.concatenate([points, [[9.0, 9.0, 9.0]]])
    found, crowded = unfolded(lone, faces, NOISE)
    assert np.allclose(found[-1], 9) and crowded[-1] == 0 and np.isfinite(found).all()
