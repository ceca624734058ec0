"""Parts of an atlas show what the whole shows, lie apart, and keep objects together."""

import numpy as np
import pytest

from addon.core.scene.pages import OBJECT, UDIM, lay_out

SIZE = 64
BOXES = {3: [(2, 2, 30, 20), (40, 3, 60, 9)], 5: [(2, 30, 12, 60)], 9: [(20, 30, 22, 33), (30, 40, 55, 62)]}
"""By object: islands on the room's atlas, in texels."""


def room():
    """Two triangles for each island: triangles, texture coordinates, object_id."""
    triangles, uv, owner = [], [], []
    for number, islands in BOXES.items():
        for x0, y0, x1, y1 in islands:
            first = 4 * len(owner)
            corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]) / SIZE
            for face in ((0, 1, 2), (0, 2, 3)):
                triangles.append([first + k for k in face])
                uv.append(corners[list(face)])
                owner.append(number)
    return np.array(triangles), np.float32(uv), np.array(owner)


def inside(rng, uv):
    """Points in each triangle: which one, and barycentric weights."""
    triangle = np.repeat(np.arange(len(uv)), 200)
    weight = rng.dirichlet((1, 1, 1), len(triangle))
    return triangle, weight


def sample(image, at):
    """Bilinear, as a renderer has it; `at` in texels."""
    low = np.floor(at - 0.5).astype(int)
    a, b = (at - 0.5 - low).T[..., None]
    x0, x1, y0, y1 = (
        np.clip(v, 0, n - 1)
        for v, n in zip((low[:, 0], low[:, 0] + 1, low[:, 1], low[:, 1] + 1), np.repeat(image.shape[1::-1], 2))
    )
    return (1 - b) * ((1 - a) * image[y0, x0] + a * image[y0, x1]) + b * ((1 - a) * image[y1, x0] + a * image[y1, x1])


@pytest.mark.parametrize(("kind", "largest"), [(OBJECT, 256), (UDIM, 256), (UDIM, 64), (UDIM, 48)])
@pytest.mark.parametrize("scale", [{}, {5: 2.0}])
def test_a_part_shows_what_the_room_shows(kind, largest, scale):
    triangles, uv, owner = room()
    rng = np.random.default_rng(0)
    y, x = np.mgrid[0:SIZE, 0:SIZE]
    smooth = np.stack([x, y, np.sin(x / 9)], -1).astype(np.float32) / SIZE
    found = lay_out(kind, triangles, uv, owner, SIZE, scale, largest)
    sheet = found.image(smooth)
    triangle, weight = inside(rng, uv)
    truth = sample(smooth, SIZE * np.einsum("nk,nkc->nc", weight, uv[triangle]))
    at = np.einsum("nk,nkc->nc", weight, found.uv[triangle].astype(float))
    own = np.array([found.scale[int(number)] for number in owner])[triangle]
    seen = np.full((len(at), 3), np.nan)
    for page in found.pages:
        if kind == OBJECT:
            here, local = owner[triangle] == page.number, at
        else:
            tile = np.array([(page.number - 1001) % 10, (page.number - 1001) // 10])
            here, local = (np.floor(at) == tile).all(1), at - tile
        part = found.of(sheet, page)
        assert part.shape[0] <= largest and part.shape[1] <= largest
        seen[here] = sample(part, local[here] * part.shape[1::-1])
    assert np.abs(seen - truth)[own == 1].max() < 1e-5
    assert np.abs(seen - truth).max() < 0.02


@pytest.mark.parametrize(("kind", "largest"), [(OBJECT, 256), (UDIM, 256), (UDIM, 48)])
def test_islands_lie_apart_and_objects_together(kind, largest):
    triangles, uv, owner = room()
    found = lay_out(kind, triangles, uv, owner, SIZE, {5: 1.5}, largest)
    taken = np.zeros((found.size, found.size), int)
    for _, _, x, y, width, height in found.island.astype(int):
        taken[y : y + height, x : x + width] += 1
    assert taken.max() == 1
    assert found.sheet_uv.min() >= 0 and found.sheet_uv.max() <= 1
    if kind == OBJECT:
        assert [page.number for page in found.pages] == sorted(BOXES)
        assert found.uv.min() >= 0 and found.uv.max() <= 1
    else:
        tiles = {number: {tuple(t) for t in np.floor(found.uv[owner == number].mean(1)).tolist()} for number in BOXES}
        assert all(len(some) == 1 for some in tiles.values())
        assert (len(found.pages) == 1) == (largest == 256)


def test_what_is_larger_than_an_image_is_made_smaller():
    triangles, uv, owner = room()
    found = lay_out(OBJECT, triangles, uv, owner, SIZE, {3: 4.0}, 96)
    assert all(max(page.width, page.height) <= 96 for page in found.pages)
    assert 1 < found.scale[3] < 4 and found.scale[5] == 1


def test_an_object_larger_than_a_tile_goes_on_several():
    count = 30
    corners = np.float32([[(k % 6 * 10 + 1, k // 6 * 10 + 1) for _ in "abc"] for k in range(count)])
    uv = np.float32((corners + [(0, 0), (8, 0), (0, 8)]) / SIZE)
    found = lay_out(UDIM, np.arange(3 * count).reshape(-1, 3), uv, np.zeros(count, int), SIZE, {}, 32)
    assert len(found.pages) > 1 and found.scale == {0: 1.0}
    local = found.uv - np.floor(found.uv.mean(1))[:, None]
    assert local.min() >= 0 and local.max() <= 1


def test_a_part_shows_nothing_of_another_object():
    """An island of 3 is L-shaped; in the corner that it leaves lies one of 5."""
    corners = [[(1, 1), (20, 1), (1, 20)], [(14, 14), (20, 14), (20, 20)]]
    uv, owner = np.float32(corners) / SIZE, np.array([3, 5])
    y, x = np.mgrid[0:SIZE, 0:SIZE]
    texel = np.where(x + y < 23, 3, 5)
    for scale in ({}, {3: 2.0}):
        found = lay_out(OBJECT, np.arange(6).reshape(2, 3), uv, owner, SIZE, scale, 256)
        sheet = found.image(texel[..., None].astype(np.float32), texel)
        assert all((found.of(sheet, page) == page.number).all() for page in found.pages)
