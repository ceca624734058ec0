"""A mesh in one piece taken apart: a furnished room as a depth camera fuses it, a dome on a floor."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.scene.shape_parts import parts_of, shape_parts

AIR = (30, 24, 20)
"""Voxels of the room, of a decimetre each."""
TABLE, WARDROBE = (slice(8, 18), slice(9, 17), slice(0, 6)), (slice(0, 5), slice(16, 24), slice(0, 15))


def fused(noise: float = 0.01, seed: int = 0):
    """The surface between air and a room's floor, walls, ceiling, table and wardrobe, seen from the air, with noise.

    Returns vertices, triangles and what each triangle is of: 0...5 sides of the room, 6 the table, 7 the wardrobe.
    """
    solid = np.full([n + 2 for n in AIR], -1)
    solid[1:-1, 1:-1, 1:-1] = 0
    inner = solid[1:-1, 1:-1, 1:-1]
    inner[TABLE], inner[WARDROBE] = -7, -8
    quads, label = [], []
    for axis in range(3):
        for way in (-1, 1):
            there = np.roll(solid, -way, axis)
            for cell in np.argwhere((solid == 0) & (there < 0)):
                thing = -there[tuple(cell)] - 1
                corner = cell + np.eye(3, dtype=int)[axis] * (way > 0)
                u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
                ring = [corner, corner + u, corner + u + v, corner + v]  # faces along +axis
                quads.append(ring if way < 0 else ring[::-1])
                label.append(thing or 2 * axis + (way > 0))
    corners = np.array(quads) - 1
    points, place = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    place = place.reshape(-1, 4)
    vertices = 0.1 * points + np.random.default_rng(seed).normal(0, noise, points.shape)
    triangles = np.concatenate([place[:, [0, 1, 2]], place[:, [0, 2, 3]]])
    return vertices, triangles, np.tile(label, 2)


def purity(part, label):
    """Share of the triangles in parts whose majority is their own thing."""
    return sum(np.bincount(label[part == one]).max() for one in np.unique(part)) / len(part)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_furnished_room_in_one_piece(noise):
    vertices, triangles, label = fused(noise)
    part, names, _ = parts_of(vertices, triangles)
    assert purity(part, label) > 0.95
    assert len(np.unique(part)) < 25
    named = {side: names[int(np.bincount(part[label == side]).argmax())] for side in range(6)}
    assert named == {0: "wall", 1: "wall", 2: "wall", 3: "wall", 4: "floor", 5: "ceiling"}
    assert sorted(names.values()).count("floor") == 1 and set(names) == set(np.unique(part).tolist())


def test_a_wall_at_the_end_of_the_cameras_depth_is_one_plane_though_it_is_islands():
    vertices, triangles, side = fused()
    centre = vertices[triangles].mean(1)
    cell = np.floor(centre[:, 1:] / 0.2).astype(int).sum(1)
    kept = (side != 1) | (cell % 2 == 0) & (np.abs(centre[:, 1:] - [1.2, 1.0]).max(1) < 0.8)
    planes = parts_of(vertices, triangles[kept]).planes
    (wall,) = (one for one in planes if one.normal[0] < -0.9 and one.name == "wall")
    assert wall.point[0] == pytest.approx(3, abs=0.05)
    assert len(wall.faces) > 0.8 * (side[kept] == 1).sum()


def test_the_unit_of_length_and_the_place_do_not_matter():
    vertices, triangles, _ = fused()
    one = shape_parts(vertices, triangles)
    other = shape_parts(1000 * vertices - 3e4, triangles)
    assert one[1] == other[1] and (one[0] == other[0]).mean() > 0.999


def test_a_dome_is_one_part_and_its_floor_another():
    x, y = np.meshgrid(np.linspace(-2, 2, 81), np.linspace(-2, 2, 81), indexing="ij")
    height = np.sqrt(np.maximum(0.8**2 - x**2 - y**2, 0))
    vertices = np.stack([x, y, height], -1).reshape(-1, 3)
    number = np.arange(81 * 81).reshape(81, 81)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    part, names, _ = shape_parts(vertices, triangles)
    centre = vertices[triangles].mean(1)
    dome, floor = part[centre[:, 2] > 0.25], part[np.linalg.norm(centre[:, :2], axis=1) > 1]
    assert (floor == 0).all() and names == {0: "floor"}
    assert (dome == np.bincount(dome).argmax()).mean() > 0.9 and not (dome == 0).any()


def test_a_few_triangles_without_any_area_are_no_error():
    part, *_ = parts_of(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert part.tolist() == [0]
