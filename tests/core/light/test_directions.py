"""Directions over the hemisphere: their densities, by moments, and the frames that turn them."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.light.directions import cosine_hemisphere, shifted, sobol
from addon.core.paper.irradiance import uniform_hemisphere
from addon.core.scene.tangent_frame import tangent_frame, to_world

COUNT = 4096


@pytest.mark.parametrize(
    ("sample", "moments"), [(cosine_hemisphere, (2 / 3, 1 / 2, 2 / 5)), (uniform_hemisphere, (1 / 2, 1 / 3, 1 / 4))]
)
def test_moments_of_the_height(sample, moments):
    """E[z^k]: 2 / (k + 2) for density cos / pi, 1 / (k + 1) for 1 / (2 pi)."""
    d = sample(sobol(COUNT, 0))
    assert np.allclose(np.linalg.norm(d, axis=1), 1, atol=1e-5) and (d[:, 2] >= 0).all()
    for k, wanted in enumerate(moments, 1):
        assert (d[:, 2].astype(float) ** k).mean() == pytest.approx(wanted, rel=2e-3)
    second = (1 - moments[1]) / 2
    assert (d[:, 0] ** 2).mean() == pytest.approx(second, rel=5e-3)
    assert (d[:, 1] ** 2).mean() == pytest.approx(second, rel=5e-3)
    for odd in (d[:, 0], d[:, 1], d[:, 0] * d[:, 1], d[:, 0] * d[:, 2], d[:, 1] * d[:, 2]):
        assert odd.mean() == pytest.approx(0, abs=3e-3)


def normals(count: int = 500) -> np.ndarray:
    n = np.random.default_rng(0).normal(size=(count, 3))
    n = np.concatenate([n, np.eye(3), -np.eye(3), [[0, 0, -1], [1e-4, 0, -1], [0, -1e-7, -1], [1, 0, -0.0]]])
    return (n / np.linalg.norm(n, axis=1, keepdims=True)).astype(np.float32)


def test_tangent_frames_are_right_handed_and_orthonormal():
    n = normals()
    t, b = tangent_frame(n)
    frame = np.stack([t, b, n], 1).astype(float)
    assert np.allclose(frame @ frame.transpose(0, 2, 1), np.eye(3), atol=1e-5)
    assert np.allclose(np.linalg.det(frame), 1, atol=1e-5)


def test_to_world_turns_the_pole_into_the_normal():
    n = normals(20)
    local = cosine_hemisphere(sobol(64, 1))[None]
    world = to_world(local, n)
    assert world.shape == (len(n), 64, 3)
    assert np.allclose(np.einsum("nkj,nj->nk", world, n), np.broadcast_to(local[..., 2], (len(n), 64)), atol=1e-5)
    assert np.allclose(to_world(np.float32([[[0, 0, 1]]]), n)[:, 0], n)


def test_shifted_patterns_stay_in_the_square_and_differ():
    points = sobol(16, 0)
    moved = shifted(points, 5, np.random.default_rng(0))
    assert moved.shape == (5, 16, 2) and (moved >= 0).all() and (moved < 1).all()
    assert len(np.unique(moved[:, 0, 0])) == 5


@pytest.mark.parametrize("count", [1, 7, 100])
def test_sobol_gives_as_many_as_asked(count):
    points = sobol(count, 3)
    assert points.shape == (count, 2) and points.dtype == np.float32
    assert np.array_equal(points, sobol(count, 3))
    assert not np.array_equal(points, sobol(count, 4))
