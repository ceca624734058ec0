"""Flat parts of a noisy mesh are found; what is round stays round, and thin plates keep two sides."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.mesh_denoising import denoise
from addon.core.passes.mesh_denoising.planes import neighbours_of, sheet_of, sheets_of
from addon.core.scene.model import Mesh
from addon.core.scene.weld import one_place, welded
from tests.core.passes.mesh_denoising.test_denoise import NOISE, cube, noisy, rms, sheet, smoothed, sphere, tilted, tube
from tests.core.rooms import make_room, quad, split


def board(thick: float, parts: int = 24) -> Mesh:
    """0.36 by 0.36 m, closed by four sides of one quad in the height."""
    box = cube(0.36, parts)
    middle = (box.vertices[:, 2] > 1e-6) & (box.vertices[:, 2] < 0.36 - 1e-6)
    keep = ~middle[box.triangles].any(1)
    flat = box.vertices * [1, 1, thick / 0.36]
    edge = np.linspace(0, 0.36, parts + 1)
    sides = []
    for axis in (0, 1):
        for at in (0.0, 0.36):
            for low, high in zip(edge[:-1], edge[1:]):
                corners = np.zeros((4, 3))
                corners[:, axis], corners[:, 1 - axis] = at, (low, high, high, low)
                corners[2:, 2] = thick
                sides.append(corners if (axis == 0) == (at > 0) else corners[::-1])
    count = len(flat) + 4 * np.arange(len(sides))[:, None, None]
    triangles = np.concatenate([box.triangles[keep], (count + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)])
    vertices = np.round(np.concatenate([flat, *sides]), 9)
    return Mesh(vertices, triangles, np.zeros(len(triangles), np.int32))


def by_angles_alone(mesh: Mesh, noise: float = NOISE) -> Mesh:
    return Mesh(denoise.denoised(mesh, noise, without=("sheets",)), mesh.triangles, mesh.object_id)


def found_in(mesh: Mesh, noise: float = NOISE):
    points, faces, _ = welded(mesh, one_place(mesh.vertices))
    return sheets_of(points, points, faces, noise)[0]


def test_neighbours_know_how_they_are_wound():
    across, alike = neighbours_of(np.array([[0, 1, 2], [2, 1, 3], [1, 3, 4]]))
    assert across.tolist() == [[-1, 1, -1], [0, 2, -1], [1, -1, -1]]
    assert alike[0, 1] == alike[1, 0] == 1  # the edge is gone along once each way
    assert alike[1, 1] == alike[2, 0] == -1


@pytest.mark.parametrize("seed", range(3))
def test_a_mirror_of_a_few_triangles_is_flat_to_the_eye(seed):
    """A crease of half a degree would show in it."""
    true = make_room(split(quad((0, 0, 0), (0.7, 0, 0), (0, 1.3, 0), 0), 2), 0.05).mesh
    off = noisy(true, seed=seed)

    def crease(mesh: Mesh) -> float:
        corners = mesh.vertices[mesh.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return float(np.degrees(np.arccos(np.clip((normal @ normal.T).min(), -1, 1))))

    assert crease(by_angles_alone(off)) > 0.5
    assert crease(smoothed(off)) < 0.02
    assert tilted(smoothed(off), true).max() < 1


@pytest.mark.parametrize("parts", [2, 5, 20])
@pytest.mark.parametrize("noise", [0.002, 0.005, 0.008])
def test_a_box_has_six_planes_and_sharp_edges(parts, noise):
    true = cube(0.6, parts)
    off = noisy(true, noise, seed=1)
    found = Mesh(denoise.denoised(off, noise), true.triangles, true.object_id)
    angle = tilted(found, true)
    assert np.median(angle) < max(0.4 * np.median(tilted(off, true)), 0.1)
    if parts == 20:
        assert angle.max() < 0.6 and np.median(tilted(off, true)) > 5
        assert rms(found.vertices - true.vertices) < 0.4 * rms(off.vertices - true.vertices)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.002, 0.005, 0.008])
def test_what_is_round_is_not_faceted(noise):
    """No planar region is found, and so nothing is moved."""

    def moved(true: Mesh) -> bool:
        off = noisy(true, noise)
        return not np.array_equal(denoise.denoised(off, noise), denoise.denoised(off, noise, without=("sheets",)))

    wide = tube(0.3, 1.0, 40, 20)
    thin = Mesh(wide.vertices * [0.2, 0.2, 0.6], wide.triangles, wide.object_id)
    assert not any(moved(true) for true in (sphere(0.3, 24), sphere(0.1, 20), wide, thin))
    assert moved(cube(0.6))


@pytest.mark.parametrize("seed", range(3))
def test_front_and_back_of_a_plate_as_thin_as_the_noise_stay_two(seed):
    true = board(NOISE)
    off = noisy(true, seed=seed)
    found = smoothed(off)
    front, back = (np.abs(true.vertices[true.triangles][:, :, 2] - z).max(1) < 1e-6 for z in (NOISE, 0.0))
    assert 0.9 < front.sum() / (2 * 24**2) <= 1 and back.sum() == front.sum()
    heights = [np.unique(true.triangles[side]) for side in (front, back)]
    measured = [off.vertices[side, 2] for side in heights]
    assert measured[0].min() < measured[1].max()  # the scan's sides cross
    upper, lower = (found.vertices[side, 2] for side in heights)
    assert np.median(upper) - np.median(lower) == pytest.approx(NOISE, abs=0.0012)
    # All but those few that crossed so closely that they were welded.
    middle = (np.median(upper) + np.median(lower)) / 2
    assert np.mean(upper > middle) > 0.995 and np.mean(lower < middle) > 0.995
    assert np.mean(measured[0] > middle) < 0.95
    now, before = (tilted(mesh, true)[front | back] for mesh in (found, by_angles_alone(off)))
    assert np.quantile(now, 0.95) < 0.5 < np.quantile(before, 0.95)


def test_small_triangles_do_not_lead_around_an_edge():
    """Of 1 cm under noise of 8 mm: however much these may be tilted, sides of a box are sides."""
    true = cube(0.25, 25)
    off = noisy(true, 0.008, seed=2)
    found = Mesh(denoise.denoised(off, 0.008), true.triangles, true.object_id)
    before = tilted(by_angles_alone(off, 0.008), true)
    assert np.quantile(tilted(found, true), 0.9) < 0.6 < np.quantile(before, 0.9)
    assert rms(found.vertices - true.vertices) < 0.5 * rms(off.vertices - true.vertices)


def test_a_moulding_around_a_room_is_no_plane():
    """A ring of 2 cm, inclined by 11 degrees, lies in a plane within the noise, which says nothing of how it faces."""
    x = np.linspace(0, 2 * np.pi, 5)[:-1] + np.pi / 4
    ring = np.stack([np.cos(x), np.sin(x), 0 * x], 1)
    inner, outer = 2.0 * ring, 2.0 * ring * 1.015 + [0, 0, 0.004]
    faces = [[k, (k + 1) % 4, 4 + (k + 1) % 4] for k in range(4)] + [[k, 4 + (k + 1) % 4, 4 + k] for k in range(4)]
    mesh = Mesh(np.concatenate([inner, outer]), np.array(faces), np.zeros(8, np.int32))
    assert found_in(mesh) == []
    wide = Mesh(mesh.vertices * [[1, 1, 0]] * ([[0.2]] * 4 + [[1]] * 4), mesh.triangles, mesh.object_id)
    assert len(found_in(wide)) == 1


def test_a_bend_is_weighed_against_the_noise():
    rng = np.random.default_rng(5)
    xy = rng.uniform(-0.3, 0.3, (200, 2))
    flat = np.c_[xy, NOISE * rng.normal(size=200)]
    found = sheet_of(flat, np.arange(1), 0.36, 2.4, NOISE)
    assert found is not None and abs(found.normal[2]) > 0.9999
    bowl = flat + np.c_[np.zeros((200, 2)), 0.2 * (xy**2).sum(1)]
    assert sheet_of(bowl, np.arange(1), 0.36, 2.4, NOISE) is None
    few = flat[:4] * [0.1, 0.1, 1]  # 6 cm of four points say nothing
    assert sheet_of(few, np.arange(1), 0.0036, 0.24, NOISE) is None


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_picture_before_a_wall_is_not_torn(seed):
    """It hangs four times the noise before it, and is denoised to a fifth of the noise by angles alone."""
    inside = np.zeros((61, 61), bool)
    inside[20:38, 24:37] = True
    edge = np.linspace(0, 1.8, 61)
    off = noisy(sheet(edge, edge, lambda u, v: np.where(inside, 0.02, 0)), 0.005, seed=seed)
    found = denoise.denoised(off, 0.005)[:, 2].reshape(61, 61)
    assert np.quantile(np.abs(found[21:37, 25:36] - 0.02), 0.9) < 0.005
    assert np.quantile(np.abs(found[~inside]), 0.99) < 0.005
