"""Noise goes out of a mesh; edges, sizes, borders, seams and clean meshes stay."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.passes.mesh_denoising.denoise import denoised, dihedral, hinges_of, without_noise
from addon.core.scene.mesh_noise import noise_of
from addon.core.scene.model import Mesh
from addon.core.scene.weld import point_normals, welded
from tests.core.rooms import make_room, quad, split

NOISE = 0.005


def cube(edge: float = 0.4, parts: int = 20) -> Mesh:
    """Each square a quad of its own: every vertex is listed up to six times."""
    e, o = np.eye(3) * edge, (0, 0, 0)
    far = tuple(e.sum(0))
    sides = [quad(o, e[j], e[i], 0) for i, j in ((0, 1), (1, 2), (2, 0))]
    sides += [quad(far, -e[i], -e[j], 0) for i, j in ((0, 1), (1, 2), (2, 0))]
    mesh = make_room([q for side in sides for q in split(side, parts)], 0.05).mesh
    return Mesh(np.round(mesh.vertices, 9), mesh.triangles, mesh.object_id)


def sphere(radius: float = 0.3, parts: int = 40) -> Mesh:
    """A cube's vertices moved out to a sphere."""
    box = cube(2.0, parts)
    out = box.vertices - 1
    return Mesh(radius * out / np.linalg.norm(out, axis=1, keepdims=True), box.triangles, box.object_id)


def sheet(x: np.ndarray, y: np.ndarray, height) -> Mesh:
    """A grid with `height(x, y)` over it."""
    u, v = np.meshgrid(x, y, indexing="ij")
    vertices = np.stack([u, v, height(u, v)], 2).reshape(-1, 3)
    first = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (k.ravel() for k in (first[:-1, :-1], first[1:, :-1], first[1:, 1:], first[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Mesh(vertices, triangles, np.zeros(len(triangles), np.int32))


def tube(radius: float, length: float, around: int, along: int) -> Mesh:
    """Open at both ends, of so many strips each way."""
    flat = sheet(np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, length, along + 1), lambda u, v: 0 * u)
    u, v = flat.vertices[:, 0], flat.vertices[:, 1]
    vertices = np.stack([radius * np.cos(u), radius * np.sin(u), v], 1)
    return Mesh(np.round(vertices, 9), flat.triangles, flat.object_id)


def noisy(mesh: Mesh, noise: float = NOISE, seed: int = 0) -> Mesh:
    """Moved along the normals, what lies in one place together."""
    points, faces, place = welded(mesh)
    offset = noise * np.random.default_rng(seed).normal(size=len(points))
    moved = points + offset[:, None] * point_normals(points, faces)
    return Mesh(moved[place], mesh.triangles, mesh.object_id)


def tilted(mesh: Mesh, true: Mesh) -> np.ndarray:
    """Degrees between the triangles' normals."""
    a, b = mesh.geometry[0], true.geometry[0]
    return np.degrees(np.arccos(np.clip((a * b).sum(1), -1, 1)))


def smoothed(mesh: Mesh) -> Mesh:
    return Mesh(denoised(mesh, NOISE), mesh.triangles, mesh.object_id)


def rms(a: np.ndarray) -> float:
    return float(np.sqrt(np.mean(a**2)))


def test_angle_changes_by_its_gradient():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(4, 3))
    hinges = hinges_of(np.array([[0, 1, 2], [3, 0, 1]]))
    assert hinges.tolist() == [[0], [1], [2], [3]]
    theta, gradient = dihedral(points, hinges)
    for at, by in enumerate(gradient):
        for axis in range(3):
            moved = points.copy()
            moved[at, axis] += 1e-6
            assert (dihedral(moved, hinges)[0] - theta) / 1e-6 == pytest.approx(by[:, axis], rel=1e-3, abs=1e-4)


def test_a_cube_is_flat_again_with_sharp_edges():
    true = cube()
    off, found = noisy(true), smoothed(noisy(true))
    assert np.median(tilted(off, true)) > 10 and np.median(tilted(found, true)) < 1
    # Triangles beside an edge are no rounder than the rest.
    centre = np.sort(np.abs(true.vertices[true.triangles].mean(1) - 0.2), 1)
    beside = (centre[:, 2] > 0.199) & (centre[:, 1] > 0.18)
    assert np.median(tilted(found, true)[beside]) < 3
    assert rms(found.vertices - true.vertices) < 0.5 * rms(off.vertices - true.vertices)


@pytest.mark.slow
def test_a_sphere_keeps_its_radius():
    true = sphere()
    found = smoothed(noisy(true))
    radius = np.linalg.norm(found.vertices, axis=1)
    assert radius.mean() == pytest.approx(0.3, abs=0.0005)
    assert radius.std() < 0.5 * NOISE
    assert np.median(tilted(found, true)) < 0.35 * np.median(tilted(noisy(true), true))


def test_an_open_sheet_does_not_shrink():
    sheet = make_room(split(quad((0, 0, 0), (1, 0, 0), (0, 1, 0), 0), 40), 0.05).mesh
    found = smoothed(noisy(sheet))
    along = np.linalg.norm((found.vertices - sheet.vertices)[:, :2], axis=1)
    assert rms(along) < 0.001 and along.max() < NOISE
    assert np.abs(found.vertices[:, 2]).max() < 0.01 and np.median(tilted(found, sheet)) < 1


def test_the_two_sides_of_a_thin_board_stay_apart():
    """2 cm, four times the noise."""
    board = split(quad((0, 0, 0), (0, 1, 0), (1, 0, 0), 0), 40) + split(quad((0, 0, 0.02), (1, 0, 0), (0, 1, 0), 0), 40)
    mesh = make_room(board, 0.05).mesh
    found = smoothed(noisy(mesh))
    upper = mesh.vertices[:, 2] > 0.01
    assert found.vertices[upper, 2].mean() - found.vertices[~upper, 2].mean() == pytest.approx(0.02, abs=0.0005)
    assert found.vertices[upper, 2].min() > found.vertices[~upper, 2].max()


def test_seams_stay_closed_and_windings_do_not_matter():
    mesh = noisy(cube())
    found = smoothed(mesh)
    _, _, place = welded(mesh)
    assert len(np.unique(place)) < 0.3 * len(place)
    low = np.full((place.max() + 1, 3), np.inf)
    high = -low
    np.minimum.at(low, place, found.vertices)
    np.maximum.at(high, place, found.vertices)
    assert np.abs(high - low).max() < 1e-12
    assert np.array_equal(denoised(mesh, NOISE), found.vertices)  # the same again
    turned = mesh.triangles.copy()
    turned[::3] = turned[::3, ::-1]
    other = Mesh(denoised(Mesh(mesh.vertices, turned, mesh.object_id), NOISE), mesh.triangles, mesh.object_id)
    assert np.median(tilted(other, cube())) < 2


def test_large_triangles_and_small_parts_stay():
    """A bevel of 6 degrees between squares of half a metre is no noise; a knob of 6 mm has no shape left in it."""
    bent = make_room([quad((0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), 0), quad((0.5, 0, 0), (0.5, 0, 0.05), (0, 0.5, 0), 0)],
                     0.05).mesh  # fmt: skip
    assert np.abs(denoised(bent, 0.001) - bent.vertices).max() < 0.001
    knob = noisy(cube(0.006, 8), 0.0005)
    assert np.array_equal(denoised(knob, NOISE), knob.vertices)
    # Nor does it move where it is one part among others.
    box, own = noisy(cube()), knob.vertices + 1
    triangles = np.concatenate([box.triangles, knob.triangles + len(box.vertices)])
    both = Mesh(np.concatenate([box.vertices, own]), triangles, np.zeros(len(triangles), np.int32))
    assert np.array_equal(denoised(both, NOISE)[len(box.vertices) :], own)


def test_a_clean_mesh_is_left_to_the_last_bit():
    for mesh in (cube(), sphere()):
        found, noise = without_noise(mesh)
        assert found is mesh and noise == 0
    assert np.array_equal(denoised(cube(), 0.0), cube().vertices)
    found, noise = without_noise(noisy(cube()))
    assert noise == pytest.approx(NOISE, rel=0.25)
    assert noise_of(found) < 0.25 * NOISE
