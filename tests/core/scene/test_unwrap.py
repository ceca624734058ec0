"""Atlases without Blender."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.core.errors import BadInputError
from addon.core.scene.model import Mesh
from addon.core.scene.params import SURFACE
from addon.core.scene.two_sides import with_backs
from addon.core.scene.unwrap import by_xatlas, own_coordinates
from addon.core.scene.uv_islands import areas
from addon.core.scene.uv_overlap import overlapping_pairs
from tests.core.rooms import lit_box, make_room

SIZE = 512


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    """A room with texture coordinates of its own."""
    room = make_room(lit_box(), 0.1)
    return replace(room.mesh, uv=room.uv)


def check(mesh: Mesh, uv: np.ndarray):
    assert uv.shape == (len(mesh.triangles), 3, 2) and uv.dtype == np.float32
    assert uv.min() >= 0 and uv.max() <= 1 and (areas(uv) > 0).all()
    assert not len(overlapping_pairs(uv, SURFACE.overlap_texels / SIZE))


def test_own_coordinates_stay(mesh):
    assert (own_coordinates(mesh, SIZE) == mesh.uv).all()


def test_second_sides_get_a_place_of_their_own(mesh):
    both = with_backs(mesh, np.array([3, 4]))
    check(both, own_coordinates(both, SIZE))


@pytest.mark.parametrize(
    "uv, said",
    [
        (lambda uv: None, "no texture coordinates"),
        (lambda uv: 2 * uv, "outside of 0 to 1"),
        (lambda uv: np.where(np.arange(len(uv))[:, None, None] == 5, uv[:1], uv), "overlap .1 pairs"),
        (lambda uv: np.where(uv > 0.5, np.float32(np.nan), uv), "outside of 0 to 1"),
    ],
)
def test_what_can_not_be_an_atlas_is_told(mesh, uv, said):
    with pytest.raises(BadInputError, match=said):
        own_coordinates(replace(mesh, uv=uv(mesh.uv)), SIZE)


def test_xatlas_lays_out_without_overlap(mesh):
    pytest.importorskip("xatlas")
    uv = by_xatlas(mesh, SIZE)
    check(mesh, uv)
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    scale = areas(uv) / np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert np.allclose(scale, np.median(scale), rtol=0.02)  # one scale all over, along both axes


def test_xatlas_takes_triangles_without_area(mesh):
    pytest.importorskip("xatlas")
    flat = replace(mesh, triangles=np.concatenate([mesh.triangles, [[0, 0, 1]]]).astype(np.int32),
                   object_id=np.append(mesh.object_id, np.int32(0)), uv=None)  # fmt: skip
    uv = by_xatlas(flat, SIZE)
    assert np.isfinite(uv).all() and uv.shape == (len(flat.triangles), 3, 2)
    check(mesh, uv[:-1])
