"""The shading benchmark's own parts: rooms with an exact answer, recorded rays, what reaches the paper's error."""

from __future__ import annotations

import numpy as np
import pytest

from addon.benchmark import shading, shading_reference
from addon.benchmark.lit_rooms import make_room
from addon.benchmark.pipeline import cut_in_four
from addon.benchmark.recorded_rays import recorded
from addon.benchmark.run import Options
from addon.benchmark.shading_reference import looked_at, relative_error
from addon.benchmark.shading_surface import DEFAULT_WAY, PAPER_WAY, over

SMALL = 3000


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(shading_reference, "REFERENCE", (1 << 10, 1 << 8, 1 << 10))


def test_the_furnace_is_exact():
    room = make_room("furnace", SMALL, 0)
    element, true = looked_at(room, 100, Options())
    assert len(element) > 60
    E, _ = over(room, DEFAULT_WAY, Options())
    assert np.allclose(E[element], np.pi, rtol=1e-4) and np.allclose(true, np.pi)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lamp", "window", "many lamps"])
def test_rooms_are_lit_and_the_default_is_nearer_than_the_paper(name, few):
    room = make_room(name, SMALL, 0)
    element, true = looked_at(room, 150, Options())
    assert (true.mean(1) > 0).all() and np.isfinite(room.field.radiance).all()
    ours, papers = (relative_error(over(room, way, Options())[0][element], true) for way in (DEFAULT_WAY, PAPER_WAY))
    assert ours < 0.75 * papers


@pytest.mark.slow
def test_the_same_seed_gives_the_same_error(few):
    errors = []
    for _ in range(2):
        room = make_room("window", SMALL, 3)
        element, true = looked_at(room, 50, Options(seed=3))
        errors.append(relative_error(over(room, DEFAULT_WAY, Options(seed=3))[0][element], true))
    assert errors[0] == errors[1] > 0


@pytest.mark.slow
def test_rays_are_recorded_and_traced_again():
    room = make_room("lamp", SMALL, 0)
    scene = room.field.scene
    origins, up = np.zeros((5, 3), np.float32) + np.float32([2, 2, 1]), np.tile(np.float32([0, 0, 1]), (5, 1))
    with recorded(scene) as rays:
        scene.intersect(origins, up)
        scene.occluded(origins, up, np.ones(5, np.float32))
    assert len(rays) == 10
    rays.trace()
    scene.intersect(origins, up)
    assert len(rays) == 10  # no longer recorded


def test_rays_for_an_error_are_interpolated():
    assert shading._rays_for([10, 1000], [1.0, 0.1], 0.1) == pytest.approx(1000)
    assert shading._rays_for([10, 1000], [1.0, 0.1], 10**-0.5) == pytest.approx(100)
    assert shading._rays_for([10, 1000], [1.0, 0.1], 0.01) is None
    assert shading._rays_for([10, 1000], [1.0, 0.1], 2.0) == 10


def test_cutting_triangles_keeps_the_surface():
    mesh = make_room("lamp", SMALL, 0).field.mesh
    cut = cut_in_four(mesh, 2)
    assert len(cut.triangles) == 16 * len(mesh.triangles)

    def area(m):
        a, b, c = (m.vertices[m.triangles[:, i]] for i in range(3))
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2

    assert area(cut) == pytest.approx(area(mesh))
    assert np.array_equal(np.bincount(cut.object_id), 16 * np.bincount(mesh.object_id))
