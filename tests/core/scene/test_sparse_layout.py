"""Texels where frames look: what they don't see, or from far away, takes few texels and fewer elements."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from addon.core.pipeline.surface import from_store, to_store
from addon.core.scene.elements import ElementLookup
from addon.core.scene.model import Mesh
from addon.core.scene.pages import OBJECT, lay_out, shelves
from addon.core.scene.params import SPARSE
from addon.core.scene.sparse_layout import flattened, tiled
from addon.core.scene.surface import build_surface
from addon.core.scene.unwrap import of_parts
from addon.core.scene.uv_overlap import overlapping_pairs
from tests.core.rooms import box_sides, look_at, make_room, quad, split

SIZE = (4.0, 3.0, 2.5)
TARGETS = ((4, 1.5, 1), (0, 1.5, 1), (2, 0, 1), (2, 3, 1), (2, 1.6, 0))
VIEWS = [look_at((2, 1.5, 1.2), target, 64, 64) for target in TARGETS]
GROUND, BEADS = 20, 21


@of_parts
def one_by_one(mesh: Mesh, size: int) -> np.ndarray:
    """Each triangle by itself, at one scale."""
    flat = flattened(mesh.vertices[mesh.triangles])
    unit = float(np.sqrt(mesh.geometry[1].sum())) / size * 2
    box = np.ceil(flat.max(1) / unit) + 3
    width = int(np.sqrt(box.prod(1).sum()) * 1.2) + int(box[:, 0].max())
    place, across, up = shelves(box, width)
    return ((flat / unit + place[:, None] + 1) / max(across, up)).astype(np.float32)


def room_in(*more):
    return make_room([*box_sides(SIZE), *more])


def ground(size: float = 400.0):
    return quad((2 - size / 2, 1.5 - size / 2, -0.1), (size, 0, 0), (0, size, 0), GROUND)


def beads():
    """Far smaller than a texel, outside of the room."""
    return split(quad((6, 1, 1), (0, 0.3, 0), (0, 0, 0.3), BEADS), 30)


def laid_out(room, **how):
    return build_surface(room.mesh, VIEWS, one_by_one, texel_size=0.04, **how)


@pytest.fixture(scope="module")
def alone():
    return laid_out(room_in())


@pytest.fixture(scope="module")
def around():
    return laid_out(room_in(ground(), *beads()))


def test_a_ground_a_hundred_times_the_room_takes_no_texel_from_it(alone, around):
    inside = around.atlas.object_id < GROUND
    assert around.texel_size == pytest.approx(alone.texel_size, rel=0.05)
    assert inside.sum() == pytest.approx(len(alone.atlas), rel=0.1)
    assert len(around.atlas) < 1.2 * len(alone.atlas) and around.atlas.size < 1.2 * alone.atlas.size
    whole = laid_out(room_in(ground(), *beads()), coarse_unseen=False, largest=1024)
    assert whole.texel_size > 10 * around.texel_size  # what it was before


def test_no_two_triangles_overlap_and_each_keeps_its_object(around):
    uv, size = around.uv, around.atlas.size
    assert uv.min() >= 0 and uv.max() <= 1
    assert len(overlapping_pairs(uv, 1e-3 / size)) == 0
    mesh = around.mesh
    triangle = np.repeat(np.arange(len(mesh.triangles)), 20)
    u, v = np.random.default_rng(0).dirichlet((1, 1, 1), len(triangle))[:, :2].astype(np.float32).T
    element = ElementLookup(mesh, around.atlas)(triangle, u, v)
    np.testing.assert_array_equal(around.atlas.object_id[element], mesh.object_id[triangle])
    a, b, c = (mesh.vertices[mesh.triangles[triangle, k]] for k in range(3))
    at = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    away = np.linalg.norm(around.atlas.position[element] - at, axis=1)
    cell = SPARSE.cell * around.texel_size
    assert away[mesh.object_id[triangle] == BEADS].max() < 2 * cell
    assert away[mesh.object_id[triangle] < GROUND].max() < 2 * cell


def test_all_surface_is_some_elements(around):
    _, area = around.mesh.geometry
    for one in np.unique(around.mesh.object_id):
        told = around.atlas.area[around.atlas.object_id == one].sum()
        assert told == pytest.approx(area[around.mesh.object_id == one].sum(), rel=1e-4)


def test_between_the_texels_of_small_triangles_lies_one_value(around):
    """A bilinear lookup anywhere on them shows their element alone, so smaller copies have no seam of another's."""
    atlas, mesh = around.atlas, around.mesh
    small = np.flatnonzero(mesh.object_id == BEADS)
    at = atlas.uv[small].reshape(-1, 2).astype(np.float64) * atlas.size - 0.5
    low = np.minimum(np.floor(at + 1e-3).astype(np.int64), atlas.size - 2)
    shown = atlas.padding.reshape(atlas.size, -1)
    four = np.stack([shown[low[:, 1] + dy, low[:, 0] + dx] for dy in (0, 1) for dx in (0, 1)])
    off = np.abs(at - np.round(at)).min(1) < 1e-3  # on a line between two texels either will do
    assert (four == four[0]).all(0)[~off].all() and (atlas.object_id[four] == BEADS).all()
    assert len(np.unique(four)) < 30


def test_what_frames_see_keeps_an_element_for_each_texel():
    """A layout that is given stays; elements are merged where no frame looks, and there alone."""
    room = room_in(quad((0, 0, 2.6), (4, 0, 0), (0, 3, 0), 9), quad((6, 0, 0), (0, 3, 0), (0, 0, 2.5), 10))
    every, merged = (
        build_surface(room.mesh, VIEWS, lambda mesh, size: room.uv, 0.02, coarse_unseen=coarse)
        for coarse in (False, True)
    )
    np.testing.assert_array_equal(every.uv, merged.uv)
    assert merged.atlas.size == every.atlas.size
    seen = np.isin(every.atlas.texel, merged.atlas.texel)
    hidden = every.atlas.object_id >= 9
    assert seen[~hidden & (every.atlas.object_id != 1)].mean() > 0.8
    assert (merged.atlas.object_id >= 9).sum() < hidden.sum() / 5
    # Each texel shows an element of its object within its cell.
    shown = merged.atlas.padding[every.atlas.texel]
    np.testing.assert_array_equal(merged.atlas.object_id[shown], every.atlas.object_id)
    away = np.linalg.norm(merged.atlas.position[shown] - every.atlas.position, axis=1)
    assert away[~hidden].max() < 2 * SPARSE.cell * 0.02
    np.testing.assert_array_equal(merged.atlas.padding[merged.atlas.texel], np.arange(len(merged.atlas)))


def test_of_a_large_triangle_barely_seen_little_is_kept():
    """A floor that goes on for 400 m, of which the frames see a few: as fine as the room only if that is worth it."""
    sides = [one for one in box_sides(SIZE) if one.object_id]
    surface = laid_out(make_room([*sides, replace(ground(), corner=np.array([-198, -198.5, 0.0]))]))
    alone = laid_out(room_in())
    assert surface.texel_size < 0.042  # as was asked for
    assert len(surface.atlas) < 3 * len(alone.atlas)


def test_a_stored_surface_is_the_same(around):
    mesh = room_in(ground(), *beads()).mesh
    arrays, meta = to_store(around, mesh)
    again = from_store(arrays, meta, mesh)
    for name in ("texel", "triangle", "position", "area", "padding", "object_id", "normal", "uv"):
        np.testing.assert_array_equal(getattr(again.atlas, name), getattr(around.atlas, name))
    assert again.texel_size == around.texel_size


def test_pages_take_what_shares_texels_as_one_island(around):
    mesh, atlas = around.mesh, around.atlas
    pages = lay_out(OBJECT, mesh.triangles, atlas.uv, mesh.object_id, atlas.size, {}, 4096)
    assert (pages.island_object == BEADS).sum() < 30
    room = atlas.image(atlas.object_id.astype(np.float32)[:, None])
    sheet = pages.image(room, atlas.image(atlas.object_id, -1))
    for page in pages.pages:
        assert (pages.of(sheet, page) == page.number).all()


def test_tiled_triangles_fill_their_square_without_overlap():
    group = np.repeat([0, 1, 2, 3], [1, 2, 7, 50])
    uv = tiled(group).astype(np.float32)
    assert uv.min() >= 0 and uv.max() <= 1
    for one in range(4):
        assert len(overlapping_pairs(uv[group == one], 1e-6)) == 0


def test_flattened_triangles_keep_their_edges():
    corner = np.random.default_rng(1).normal(size=(50, 3, 3))
    flat = flattened(corner)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        np.testing.assert_allclose(
            np.linalg.norm(flat[:, a] - flat[:, b], axis=1), np.linalg.norm(corner[:, a] - corner[:, b], axis=1)
        )
    assert flat.min() > -1e-12


def test_nothing_is_laid_apart_that_the_artist_laid_out():
    """Faces told by number, and functions that say nothing of parts, get the whole mesh."""
    room, asked = room_in(), []

    def given(mesh, size):
        asked.append(len(mesh.triangles))
        return room.uv

    build_surface(room.mesh, VIEWS, given, 0.1)
    build_surface(room.mesh, VIEWS, partial(of_parts(lambda mesh, size, polygons: given(mesh, size)), polygons=()), 0.1)
    assert asked == [len(room.mesh.triangles)] * 2


def test_the_room_stays_as_large_as_it_is(alone, around):
    """What is measured by the room's size, as how far rays start off their surface, heeds no ground around it."""
    for one, factor in ((alone, 1), (around, 2)):
        low, high = one.atlas.box
        assert (high - low <= factor * np.array(SIZE) + 0.1).all() and (high - low >= np.array(SIZE) - 0.1).all()
    assert around.scene.offset < 4.1 * alone.scene.offset
    assert 0.8 * alone.atlas.area.sum() < alone.atlas.weight.sum() <= alone.atlas.area.sum()
    assert around.atlas.weight.sum() < 5 * alone.atlas.weight.sum() < 1e-3 * around.atlas.area.sum() * 5
