"""The shading benchmark's own parts: rooms with an exact answer, what reaches the paper's error."""

from __future__ import annotations

import numpy as np
import pytest

from addon.benchmark import shading, shading_reference
from addon.benchmark.lit_rooms import make_room
from addon.benchmark.pipeline import cut_in_four
from addon.benchmark.run import Options
from addon.benchmark.shading_reference import looked_at

SMALL = 3000


def test_the_furnace_is_exact():
    room = make_room("furnace", SMALL, 0)
    element, true = looked_at(room, 100, Options())
    assert len(element) > 60
    assert np.allclose(true, np.pi)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lamp", "window", "many lamps"])
def test_rooms_are_lit(name, monkeypatch):
    monkeypatch.setattr(shading_reference, "REFERENCE", (1 << 10, 1 << 8, 1 << 10))
    room = make_room(name, SMALL, 0)
    _, true = looked_at(room, 50, Options())
    assert (true.mean(1) > 0).all() and np.isfinite(room.field.radiance).all()


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
