"""Shape is shared by neighbours, noise is not."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.mesh_denoising import denoise
from addon.core.passes.mesh_denoising.moran import SLACK, moran, most_alike
from addon.core.scene.model import Mesh
from tests.core.passes.mesh_denoising.test_denoise import NOISE, noisy, sheet

GRID = np.linspace(0, 1, 31)


def pillows(height: float) -> Mesh:
    """Four of them in each direction: no plane and no bend has them."""
    return sheet(GRID, GRID, lambda x, y: height * np.sin(8 * np.pi * x) * np.sin(8 * np.pi * y))


def waves(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A scan's drift."""
    return 0.7 * NOISE * np.sin(9 * x) * np.sin(9 * y)


def test_noise_is_nothing_and_waves_are_one():
    mesh = sheet(GRID, GRID, lambda x, y: 0 * x)
    rng = np.random.default_rng(0)
    found = [moran(rng.normal(size=len(mesh.vertices)), mesh.triangles) for _ in range(200)]
    index, error = np.array(found).T
    assert index.mean() == pytest.approx(0, abs=0.005)
    assert index.std() == pytest.approx(error[0], rel=0.15)  # the error that it says is the error that it has
    slow = np.sin(2 * np.pi * mesh.vertices[:, 0])
    assert moran(slow, mesh.triangles)[0] == pytest.approx(1, abs=0.05)
    assert moran(0 * slow, mesh.triangles)[0] == 0


def test_points_of_other_triangles_do_not_count():
    mesh = sheet(GRID, GRID, lambda x, y: 0 * x)
    some = mesh.triangles[:20]
    off = np.random.default_rng(0).normal(size=len(mesh.vertices))
    other = off.copy()
    other[np.setdiff1d(np.arange(len(off)), some)] = 99
    assert moran(off, some) == moran(other, some)


def test_the_usual_is_where_most_area_lies_and_not_below_zero():
    assert most_alike([0.5, 0.1, 0.3], [1, 1, 10]) == SLACK * 0.3
    assert most_alike([-0.2, 0.4], [3, 1]) == 0
    assert most_alike([], []) == 0


def beside(wall: Mesh, other: Mesh) -> Mesh:
    """Two metres square of wall, and something else a metre off."""
    vertices = np.concatenate([wall.vertices, other.vertices + [0, 0, 1]])
    triangles = np.concatenate([wall.triangles, other.triangles + len(wall.vertices)])
    return Mesh(vertices, triangles, np.repeat([0, 1], [len(wall.triangles), len(other.triangles)]).astype(np.int32))


def flat_shares(mesh: Mesh, without=()) -> list[float]:
    """Shares of the two objects' triangles that lie in one plane with a neighbour, once the mesh is denoised."""
    corners = denoise.denoised(mesh, NOISE, without)[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    flat = np.zeros(len(normal), bool)
    edges: dict[tuple[int, int], int] = {}
    for face, (a, b, c) in enumerate(mesh.triangles.tolist()):
        for edge in ((a, b), (b, c), (c, a)):
            other = edges.setdefault((min(edge), max(edge)), face)
            if other != face and normal[face] @ normal[other] > 1 - 1e-10:
                flat[[face, other]] = True
    return [float(flat[mesh.object_id == k].mean()) for k in range(2)]


@pytest.mark.parametrize("seed", range(3))
def test_pillows_no_higher_than_the_noise_are_not_made_flat(seed):
    """A scan tells by its walls what its flat parts are like."""
    wall = sheet(2 * GRID, 2 * GRID, lambda x, y: 0 * x)
    both = noisy(beside(wall, pillows(1.4 * NOISE)), seed=seed)
    wall_flat, pillows_flat = flat_shares(both)
    assert wall_flat > 0.99 and pillows_flat < 0.2
    assert flat_shares(both, without=("shared-error",))[1] > 0.6


@pytest.mark.parametrize("seed", range(3))
def test_waves_that_all_walls_have_are_the_scans(seed):
    both = noisy(beside(sheet(2 * GRID, 2 * GRID, waves), sheet(GRID, GRID, waves)), seed=seed)
    assert min(flat_shares(both)) > 0.9
